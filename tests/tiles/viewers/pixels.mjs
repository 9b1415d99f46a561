// What both pages do with the pixels that fronts and backs of tiles cover.

export const wait = (ms) => new Promise((done) => setTimeout(done, ms));

// Pixels of backs alone. Software rasterisers round at the picture's edge: what lies there is told apart.
export function leaks_of(front, back, width, height, margin = 16) {
  let inside = 0, at_edge = 0, covered = 0, left = width, right = -1, bottom = height, top = -1;
  for (let y = 0; y < height; ++y) {
    for (let x = 0; x < width; ++x) {
      const i = y * width + x;
      if (!front[i] && !back[i]) continue;
      ++covered;
      left = Math.min(left, x);
      right = Math.max(right, x);
      bottom = Math.min(bottom, y);
      top = Math.max(top, y);
      if (front[i]) continue;
      if (x < margin || y < margin || x >= width - margin || y >= height - margin) ++at_edge; else ++inside;
    }
  }
  return { inside, at_edge, covered, box: [left, right, bottom, top] };
}
