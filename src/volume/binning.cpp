#include "volume/binning.h"

#include <algorithm>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <memory>
#include <string>

#include "base/threads.h"
#include "volume/grids/placed_grid.h"

namespace lodestone::volume {

namespace {

struct Ball {
    glm::vec3 centre{0};  // lattice space
    float radius = 0;
    std::shared_ptr<const GridReach> grid;  // that lies in it; none for most
    bool reaches(const glm::vec3& low, const glm::vec3& high) const {
        const glm::vec3 away = centre - glm::clamp(centre, low, high);
        return glm::dot(away, away) <= radius * radius && (!grid || grid->meets(low, high));
    }
};

std::vector<Ball> balls_of(const Lattice& lattice, std::span<const Particle> particles) {
    std::vector<Ball> balls;
    const glm::mat4 to_lattice = lattice.world_to_lattice();
    // A little more than they are, for what rounding does.
    for (const Particle& p : particles) {
        balls.push_back(
            {glm::vec3(to_lattice * glm::vec4(p.centre, 1)), p.radius / lattice.voxel * 1.0001f + 0.001f, nullptr});
        if (p.grid) balls.back().grid = std::make_shared<const GridReach>(*p.grid, lattice);
    }
    return balls;
}

// Calls visit(metavoxel number, particle) for every pair that may meet, particle by particle.
template <class Visit>
void for_each_meeting(const Lattice& lattice, std::span<const Ball> balls, Visit&& visit) {
    const auto voxels = static_cast<float>(lattice.voxels);
    const glm::ivec3 last = glm::ivec3(lattice.metavoxels) - 1;
    for (uint32_t i = 0; i < balls.size(); ++i) {
        if (!(balls[i].radius > 0)) continue;
        const glm::ivec3 low =
            glm::clamp(glm::ivec3(glm::floor((balls[i].centre - balls[i].radius) / voxels)), glm::ivec3(0), last);
        const glm::ivec3 high =
            glm::clamp(glm::ivec3(glm::floor((balls[i].centre + balls[i].radius) / voxels)), glm::ivec3(0), last);
        for (int z = low.z; z <= high.z; ++z) {
            for (int y = low.y; y <= high.y; ++y) {
                for (int x = low.x; x <= high.x; ++x) {
                    const glm::vec3 corner = glm::vec3(x, y, z) * voxels;
                    if (!balls[i].reaches(corner, corner + voxels)) continue;
                    const uint32_t row = static_cast<uint32_t>(z) * lattice.metavoxels.y + static_cast<uint32_t>(y);
                    visit(row * lattice.metavoxels.x + static_cast<uint32_t>(x), i);
                }
            }
        }
    }
}

// Numbers of particles by metavoxel, one after the other.
struct Meetings {
    std::vector<uint32_t> first;  // by metavoxel, and one past the last
    std::vector<uint32_t> particles;
};

Meetings meetings_of(const Lattice& lattice, std::span<const Ball> balls) {
    Meetings m;
    m.first.assign(lattice.metavoxel_count() + 1, 0);
    for_each_meeting(lattice, balls, [&](uint32_t metavoxel, uint32_t) { ++m.first[metavoxel + 1]; });
    for (size_t k = 1; k < m.first.size(); ++k) m.first[k] += m.first[k - 1];
    m.particles.resize(m.first.back());
    std::vector<uint32_t> next(m.first.begin(), m.first.end() - 1);
    for_each_meeting(lattice, balls,
                     [&](uint32_t metavoxel, uint32_t particle) { m.particles[next[metavoxel]++] = particle; });
    return m;
}

// Where the columns have gaps.
void find_gaps(const Lattice& lattice, std::vector<Brick>& bricks) {
    std::vector<int64_t> last(size_t{lattice.metavoxels.x} * lattice.metavoxels.y, -1);
    for (size_t b = 0; b < bricks.size(); ++b) {
        int64_t& before = last[size_t{bricks[b].at.y} * lattice.metavoxels.x + bricks[b].at.x];
        bricks[b].first = before < 0;
        if (before < 0) {
            bricks[b].gap_before = bricks[b].at.z;
        } else {
            Brick& above = bricks[static_cast<size_t>(before)];
            above.gap_after = bricks[b].at.z - above.at.z - 1;
            bricks[b].odd = !above.odd;
        }
        before = static_cast<int64_t>(b);
    }
    for (const int64_t b : last) {
        if (b < 0) continue;
        Brick& lowest = bricks[static_cast<size_t>(b)];
        lowest.gap_after = lattice.metavoxels.z - lowest.at.z - 1;
    }
}

// The blocks of one brick.
struct Blocks {
    std::vector<uint32_t> counts, particles;
    uint64_t occupied = 0;
    bool crowded = false;
};

Blocks blocks_of(const Lattice& lattice, const glm::uvec3& at, std::span<const uint32_t> particles,
                 std::span<const Ball> balls) {
    Blocks blocks;
    const glm::uvec3 origin = at * lattice.voxels;
    const uint32_t across = blocks_across(lattice.voxels), along = blocks_along(lattice.voxels);
    for (uint32_t y = 0; y < across; ++y) {
        for (uint32_t x = 0; x < across; ++x) {
            for (uint32_t z = 0; z < along; ++z) {
                const glm::uvec3 low = glm::uvec3(x, y, z) * block_side;
                const glm::vec3 from(origin + low), to(origin + glm::min(low + block_side, lattice.voxels));
                const size_t before = blocks.particles.size();
                for (const uint32_t p : particles) {
                    if (balls[p].reaches(from, to)) blocks.particles.push_back(p);
                }
                size_t count = blocks.particles.size() - before;
                blocks.crowded = blocks.crowded || count > most_in_block;
                count = std::min<size_t>(count, most_in_block);
                blocks.particles.resize(before + count);
                blocks.counts.push_back(static_cast<uint32_t>(count));
                if (count > 0 && z < across) blocks.occupied |= uint64_t{1} << ((z * 4 + y) * 4 + x);
            }
        }
    }
    return blocks;
}

}  // namespace

uint32_t count_bricks(const Lattice& lattice, std::span<const Particle> particles) {
    std::vector<uint8_t> met(lattice.metavoxel_count(), 0);
    for_each_meeting(lattice, balls_of(lattice, particles), [&](uint32_t metavoxel, uint32_t) { met[metavoxel] = 1; });
    return static_cast<uint32_t>(std::ranges::count(met, 1));
}

Bins bin_particles(const Lattice& lattice, std::span<const Particle> particles) {
    const std::vector<Ball> balls = balls_of(lattice, particles);
    const Meetings meetings = meetings_of(lattice, balls);
    Bins bins;
    std::vector<uint32_t> numbers;  // of metavoxels
    for (uint32_t m = 0; m < lattice.metavoxel_count(); ++m) {
        const uint32_t x = m % lattice.metavoxels.x, row = m / lattice.metavoxels.x;
        if (x == 0 && row % lattice.metavoxels.y == 0)
            bins.first_brick.push_back(static_cast<uint32_t>(bins.bricks.size()));
        if (meetings.first[m] == meetings.first[m + 1]) continue;
        Brick brick;
        brick.at = {x, row % lattice.metavoxels.y, row / lattice.metavoxels.y};
        bins.bricks.push_back(brick);
        numbers.push_back(m);
    }
    bins.first_brick.push_back(static_cast<uint32_t>(bins.bricks.size()));
    find_gaps(lattice, bins.bricks);
    std::vector<Blocks> blocks(bins.bricks.size());
    parallel_for(bins.bricks.size(), 16, [&](size_t begin, size_t end) {
        for (size_t b = begin; b < end; ++b) {
            const uint32_t first = meetings.first[numbers[b]], past = meetings.first[numbers[b] + 1];
            blocks[b] = blocks_of(lattice, bins.bricks[b].at,
                                  std::span(meetings.particles).subspan(first, past - first), balls);
        }
    });
    for (size_t b = 0; b < blocks.size(); ++b) {
        bins.bricks[b].occupied = blocks[b].occupied;
        bins.crowded = bins.crowded || blocks[b].crowded;
        auto first = static_cast<uint32_t>(bins.particles.size());
        for (const uint32_t count : blocks[b].counts) {
            bins.first_particle.push_back(first);
            bins.particle_count.push_back(count);
            first += count;
        }
        bins.particles.insert(bins.particles.end(), blocks[b].particles.begin(), blocks[b].particles.end());
    }
    return bins;
}

Result<void> Bins::validate(const Lattice& lattice) const {
    const auto wrong = [](const std::string& what) { return fail(Fault::invariant, "bins: " + what); };
    const size_t per_brick =
        size_t{blocks_across(lattice.voxels)} * blocks_across(lattice.voxels) * blocks_along(lattice.voxels);
    if (first_brick.size() != lattice.metavoxels.z + 1 || first_brick.back() != bricks.size())
        return wrong("layers do not end with the last brick");
    if (first_particle.size() != bricks.size() * per_brick || particle_count.size() != first_particle.size())
        return wrong("bricks and blocks do not go together");
    for (size_t b = 0; b < bricks.size(); ++b) {
        const Brick& brick = bricks[b];
        if (b < first_brick[brick.at.z] || b >= first_brick[brick.at.z + 1]) return wrong("a brick in a wrong layer");
        if (brick.at.z + brick.gap_after >= lattice.metavoxels.z) return wrong("a gap that leaves the lattice");
    }
    for (size_t k = 0; k < first_particle.size(); ++k) {
        if (uint64_t{first_particle[k]} + particle_count[k] > particles.size())
            return wrong("a block past the particles");
        const auto block = std::span(particles).subspan(first_particle[k], particle_count[k]);
        if (std::ranges::adjacent_find(block, std::greater_equal<>()) != block.end())
            return wrong("particles of a block out of order");
    }
    return {};
}

}  // namespace lodestone::volume
