// lod
