// Buffers that shaders read as texels of 1, 2 or 4 words: name_at(index) of a `type` of uint, uvec2 or uvec4, index counted
// in these. Software rasterisers gather texels several times as fast as words of a storage block, where neighbours read
// from different places; real ones read them through the cache of textures.
//
// Those larger than a device can bind at once are split into segments (frame/recipe.h): they are declared with LODE_POOL;
// the segment is chosen by comparison, never by a dynamic index, which not every device has; and only among as many as
// there are.
#ifndef LODESTONE_TEXELS_GLSL
#define LODESTONE_TEXELS_GLSL

#define LODE_MOST_SEGMENTS 8

// The renderer sets specialisation constant LODE_FIRST_SEGMENT_CONSTANT + binding to the words of a full segment.
#define LODE_FIRST_SEGMENT_CONSTANT 16
// And LODE_FIRST_COUNT_CONSTANT + binding to how many segments there are: mostly one, and then nothing has to be chosen.
#define LODE_FIRST_COUNT_CONSTANT 48

#define LODE_TEXELS(binding_number, name, type)                                                          \
    layout(set = 1, binding = binding_number) uniform usamplerBuffer name##_texels;                      \
    type name##_at(uint index) { return type(texelFetch(name##_texels, int(index))); }

// words: of one `type`.
#define LODE_POOL(binding_number, name, type, words)                                                     \
    layout(constant_id = LODE_FIRST_SEGMENT_CONSTANT + binding_number) const uint name##_segment_words = 1;\
    layout(constant_id = LODE_FIRST_COUNT_CONSTANT + binding_number) const uint name##_segment_count = 1;\
    layout(set = 1, binding = binding_number) uniform usamplerBuffer name##_segments[LODE_MOST_SEGMENTS];\
    type name##_at(uint index) {                                                                         \
        if (name##_segment_count == 1) return type(texelFetch(name##_segments[0], int(index)));          \
        uint length = name##_segment_words / (words);                                                    \
        int place = int(index % length);                                                                 \
        uint segment = index / length;                                                                   \
        if (name##_segment_count > 7 && segment == 7) return type(texelFetch(name##_segments[7], place));\
        if (name##_segment_count > 6 && segment == 6) return type(texelFetch(name##_segments[6], place));\
        if (name##_segment_count > 5 && segment == 5) return type(texelFetch(name##_segments[5], place));\
        if (name##_segment_count > 4 && segment == 4) return type(texelFetch(name##_segments[4], place));\
        if (name##_segment_count > 3 && segment == 3) return type(texelFetch(name##_segments[3], place));\
        if (name##_segment_count > 2 && segment == 2) return type(texelFetch(name##_segments[2], place));\
        if (name##_segment_count > 1 && segment == 1) return type(texelFetch(name##_segments[1], place));\
        return type(texelFetch(name##_segments[0], place));                                              \
    }

// Plain words of a buffer that may be split, to read and to write: name_at(index), name_put(index, word).
#define LODE_STORED_POOL(binding_number, name)                                                             \
    layout(constant_id = LODE_FIRST_SEGMENT_CONSTANT + binding_number) const uint name##_segment_words = 1;  \
    layout(constant_id = LODE_FIRST_COUNT_CONSTANT + binding_number) const uint name##_segment_count = 1;    \
    layout(set = 1, binding = binding_number, std430) buffer name##Block { uint words[]; }                   \
        name##_segments[LODE_MOST_SEGMENTS];                                                                 \
    uint name##_at(uint index) {                                                                             \
        if (name##_segment_count == 1) return name##_segments[0].words[index];                               \
        uint place = index % name##_segment_words, segment = index / name##_segment_words;                   \
        if (name##_segment_count > 7 && segment == 7) return name##_segments[7].words[place];                \
        if (name##_segment_count > 6 && segment == 6) return name##_segments[6].words[place];                \
        if (name##_segment_count > 5 && segment == 5) return name##_segments[5].words[place];                \
        if (name##_segment_count > 4 && segment == 4) return name##_segments[4].words[place];                \
        if (name##_segment_count > 3 && segment == 3) return name##_segments[3].words[place];                \
        if (name##_segment_count > 2 && segment == 2) return name##_segments[2].words[place];                \
        if (name##_segment_count > 1 && segment == 1) return name##_segments[1].words[place];                \
        return name##_segments[0].words[place];                                                              \
    }                                                                                                        \
    void name##_put(uint index, uint word) {                                                                 \
        if (name##_segment_count == 1) {                                                                     \
            name##_segments[0].words[index] = word;                                                          \
            return;                                                                                          \
        }                                                                                                    \
        uint place = index % name##_segment_words, segment = index / name##_segment_words;                   \
        if (segment == 0) name##_segments[0].words[place] = word;                                            \
        if (name##_segment_count > 1 && segment == 1) name##_segments[1].words[place] = word;                \
        if (name##_segment_count > 2 && segment == 2) name##_segments[2].words[place] = word;                \
        if (name##_segment_count > 3 && segment == 3) name##_segments[3].words[place] = word;                \
        if (name##_segment_count > 4 && segment == 4) name##_segments[4].words[place] = word;                \
        if (name##_segment_count > 5 && segment == 5) name##_segments[5].words[place] = word;                \
        if (name##_segment_count > 6 && segment == 6) name##_segments[6].words[place] = word;                \
        if (name##_segment_count > 7 && segment == 7) name##_segments[7].words[place] = word;                \
    }

#endif
