// Storage buffers larger than a device can bind at once are split into segments (frame/recipe.h). A buffer declared with
// LODE_POOL is read with name_at(index), index counted in units of `type` over all segments; the segment is chosen by
// comparison, never by a dynamic index, which not every device has.
#ifndef LODESTONE_POOL_GLSL
#define LODESTONE_POOL_GLSL

#define LODE_MOST_SEGMENTS 8

// The renderer sets specialisation constant LODE_FIRST_SEGMENT_CONSTANT + binding to the words of a full segment.
#define LODE_FIRST_SEGMENT_CONSTANT 16
// And LODE_FIRST_COUNT_CONSTANT + binding to how many segments there are: mostly one, and then nothing has to be chosen.
#define LODE_FIRST_COUNT_CONSTANT 48

// words: 32-bit words of one `type`.
#define LODE_POOL(binding_number, name, type, words)                                                     \
    layout(constant_id = LODE_FIRST_SEGMENT_CONSTANT + binding_number) const uint name##_segment_words = 1; \
    layout(constant_id = LODE_FIRST_COUNT_CONSTANT + binding_number) const uint name##_segment_count = 1;    \
    layout(set = 1, binding = binding_number, std430) readonly buffer name##_block { type values[]; }    \
        name##_segments[LODE_MOST_SEGMENTS];                                                             \
    type name##_at(uint index) {                                                                         \
        if (name##_segment_count == 1) return name##_segments[0].values[index];                          \
        uint length = name##_segment_words / (words);                                                    \
        uint place = index % length;                                                                     \
        switch (index / length) {                                                                        \
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
