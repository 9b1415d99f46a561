// Storage buffers larger than a device can bind at once are split into segments (frame/recipe.h). A buffer declared with
// LODE_POOL(set, binding, name, type) is read with name_at(element), element counted over all segments; `stride` words of
// `type` make one element of BufferSpec::stride, and the segment is chosen by comparison, never by a dynamic index.
#ifndef LODESTONE_POOL_GLSL
#define LODESTONE_POOL_GLSL

#define LODE_MOST_SEGMENTS 8

// segment_elements: how many elements of `type` a full segment holds (push or specialisation constant).
#define LODE_POOL(binding_number, name, type, segment_elements)                                          \
    layout(set = 1, binding = binding_number, std430) readonly buffer name##_block { type values[]; } name##_segments[LODE_MOST_SEGMENTS]; \
    type name##_at(uint element) {                                                                       \
        uint segment = element / (segment_elements), place = element % (segment_elements);               \
        switch (segment) {                                                                               \
            case 0: return name##_segments[0].values[place];                                             \
            case 1: return name##_segments[1].values[place];                                             \
            case 2: return name##_segments[2].values[place];                                             \
            case 3: return name##_segments[3].values[place];                                             \
            case 4: return name##_segments[4].values[place];                                             \
            case 5: return name##_segments[5].values[place];                                             \
            case 6: return name##_segments[6].values[place];                                             \
            default: return name##_segments[7].values[place];                                            \
        }                                                                                                \
    }

#endif
