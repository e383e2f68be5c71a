#version 450 core
// Red: ambient obscurance of a pixel from the depth of its neighbours (M. McGuire
// et al., "The Alchemy screen-space ambient obscurance algorithm", 2011). Green: the share of the
// sky's light that what a height map holds leaves open, in two directions per pixel; a block of four
// by four pixels covers thirty-two. Each second row and column is computed.
in vec3 ray;
layout(location = 0) out vec2 share_out;

uniform vec4 lens;
uniform mat3 camera_axes;
uniform sampler2D depth_map;
uniform sampler2D height_map;
uniform mat4 heights_clip;
uniform vec2 heights_range;  // height of the map's centre above the camera, depth range; metres
uniform float heights_side;  // side length of the height map, metres

const float RADIUS = 1.2;
const int LOOKS = 9;
// Metres to the border of the height map within which all sky counts as visible, and over which that
// begins. A share of 1 stands for what is not known; all others are less.
const float EDGE = 24.0, FADES = 24.0, LARGEST = 0.99;
const int RINGS = 12;  // distances at which heights are looked up, each so many times the one before
const float FIRST = 0.6, WIDER = 1.52;
// What stands between two distances is nearer than the one that meets it.
const float NEARER = 1.23;
const float DEEP = 3.0;  // metres below a balcony or a deck before what is above it is a wall
const float STOREY = 2.0;  // height of a balcony above what it covers, metres: only its top is known
const float DEEP_LEAVES = 0.42, DIMMING = 0.7;  // light left deep in a crown; its falling off, 1/m
const float CROWN = 4.0;  // metres from a leaf within which leaves are its own crown's

vec3 place_at(ivec2 pixel) {
    ivec2 size = textureSize(depth_map, 0);
    pixel = clamp(pixel, ivec2(0), size - 1);
    float depth = texelFetch(depth_map, pixel, 0).r;
    vec2 image = vec2(pixel.x, size.y - 1 - pixel.y);
    return depth * vec3((image - lens.zw) / lens.xy, 1.0);
}

// Difference to a neighbour on the same surface; at the border of the image, to the inner one.
vec3 slope(ivec2 pixel, vec3 place, ivec2 step) {
    vec3 after = place_at(pixel + step) - place, before = place - place_at(pixel - step);
    if (any(lessThan(pixel, step))) return after;
    if (any(greaterThanEqual(pixel + step, textureSize(depth_map, 0)))) return before;
    return abs(after.z) < abs(before.z) ? after : before;
}

float corner_light(ivec2 pixel, vec3 place, vec3 normal, float turn) {
    float reach = clamp(lens.x * RADIUS / place.z, 4.0, 90.0);
    float sum = 0.0;
    for (int look = 0; look < LOOKS; ++look) {
        float share = (float(look) + 0.5) / float(LOOKS);
        float angle = 6.2832 * (turn + share * 4.0);
        ivec2 other = pixel + ivec2(round(reach * share * vec2(cos(angle), sin(angle))));
        vec3 away = place_at(other) - place;
        float square = dot(away, away);
        float near = max(1.0 - square / (RADIUS * RADIUS), 0.0);
        sum += near * max(dot(away, normal) - 0.02 - 0.002 * place.z, 0.0) / (square + 0.02);
    }
    return clamp(1.0 - 1.1 * sum / float(LOOKS), 0.0, 1.0);
}

// Share of the sky's light on a surface from below the elevation with this slope: sin^2 for level
// ground, an approximation of the integral of cos^2 for a wall.
float below(float slope, float is_level) {
    float square = slope * slope / (1.0 + slope * slope), rise = sqrt(square);
    float upright = rise * (1.2732 - 0.1366 * square * (1.0 + rise));
    return slope > 0.0 ? mix(upright, square, is_level) : 0.0;
}

// The lowest of 32 equal shares of the sky's light, as bits.
uint lowest(float share) {
    int count = int(32.0 * share + 0.5);
    return count > 31 ? 0xffffffffu : (1u << count) - 1u;
}

// Heights above `start` of tops, tops of leaves, and undersides of leaves, from what the map holds.
vec3 heights_of(vec3 held, vec3 start) {
    return heights_range.x - (vec3(held.rg, 1.0 - held.b) - 0.5) * heights_range.y - start.z;
}

vec3 held_at(vec2 at) {
    return textureLod(height_map, 0.5 * at + 0.5, 0.0).rgb;
}

// The least of four neighbours: one texel alone may show a gap between leaves.
float least_around(vec2 at, int channel) {
    vec4 held = channel == 1 ? textureGather(height_map, 0.5 * at + 0.5, 1)
        : textureGather(height_map, 0.5 * at + 0.5, 2);
    return min(min(held.x, held.y), min(held.z, held.w));
}

// What hides the sky in a direction is a set of shares of its light, after O. Therrien and others,
// "Screen space indirect lighting with visibility bitmask" (2023).
float sky_share(vec3 place, vec3 normal, float turn, float phase) {
    vec3 start = place + normal * 0.5;
    vec2 middle = (heights_clip * vec4(start, 1.0)).xy;
    vec2 east = (heights_clip * vec4(1.0, 0.0, 0.0, 0.0)).xy;
    vec2 north = (heights_clip * vec4(0.0, 1.0, 0.0, 0.0)).xy;
    float inside = 0.5 * heights_side * (1.0 - max(abs(middle.x), abs(middle.y)));
    if (inside < EDGE) return 1.0;
    float is_level = abs(normal.z);
    vec3 around = vec3(held_at(middle).r, least_around(middle, 1), least_around(middle, 2));
    vec3 own = heights_of(around, start);
    bool in_crown = own.y > -0.5 && own.z < 0.5;
    int hidden = 0;
    for (int side = 0; side < 2; ++side) {
        // Directions are as dense as the light that a surface takes from them.
        float drawn = 0.5 * (float(side) + turn);
        float angle = is_level > 0.7 ? 6.2832 * drawn
            : atan(normal.y, normal.x) + asin(2.0 * drawn - 1.0);
        vec2 towards = vec2(cos(angle), sin(angle)), ahead = towards.x * east + towards.y * north;
        bool covered = own.x > 1.0;
        uint blocked = 0u;
        float distance = FIRST * phase;
        for (int ring = 0; ring < RINGS; ++ring) {
            vec3 heights = heights_of(held_at(middle + ahead * distance), start) / distance;
            bool stays = covered && heights.x * distance > 1.0 && distance < DEEP;
            // Past the edge of what is above the place, it hides what is steeper.
            float edge = min(own.x, STOREY) / distance;
            uint cover = covered && !stays ? ~lowest(below(edge, is_level)) : 0u;
            covered = stays;
            blocked |= stays ? 0u : cover | lowest(below(NEARER * heights.x, is_level));
            uint crown = lowest(below(NEARER * heights.y, is_level))
                & ~lowest(below(heights.z / NEARER, is_level));
            blocked |= in_crown && distance < CROWN ? 0u : crown;
            distance *= WIDER;
        }
        hidden += bitCount(blocked);
    }
    float open = 1.0 - float(hidden) / 64.0;
    if (in_crown) open *= mix(DEEP_LEAVES, 1.0, exp(-DIMMING * max(own.y, 0.0)));
    return min(mix(1.0, open, smoothstep(EDGE, EDGE + FADES, inside)), LARGEST);
}

void main() {
    ivec2 cells = ivec2(gl_FragCoord.xy), pixel = 2 * cells;
    vec3 place = place_at(pixel);
    share_out = vec2(1.0);
    if (place.z <= 0.0) return;
    vec3 right = slope(pixel, place, ivec2(1, 0)), up = slope(pixel, place, ivec2(0, 1));
    vec3 normal = normalize(cross(right, up));
    if (dot(normal, place) > 0.0) normal = -normal;
    int cell = (cells.x & 3) * 4 + (cells.y & 3);
    float turn = float((cell * 7) & 15) / 16.0;
    share_out.r = corner_light(pixel, place, normal, turn);
    float phase = exp2(log2(WIDER) * (float((cell * 5) & 15) / 16.0 - 0.5));
    share_out.g = sky_share(camera_axes * place, camera_axes * normal, turn, phase);
}
