#version 450 core
// Red: ambient obscurance of a pixel from the depth of its neighbours (M. McGuire
// et al., "The Alchemy screen-space ambient obscurance algorithm", 2011). Green: the share of the
// sky above the horizon of a height map, in three directions per pixel; a block of
// four by four pixels covers forty-eight directions. Each second row and column is computed.
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
const float EDGE = 24.0;  // metres to the border of the height map within which all sky is visible
// Edges lie between two distances, so nearer than the one that meets them: for a ratio r of the
// distances, by r ln r / (r - 1) on average.
const float NEARER = 1.3;
const float DISTANCES[6] = float[](1.5, 4.0, 8.5, 15.0, 26.0, 45.0);

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

float sky_share(vec3 place, vec3 normal, float turn) {
    vec3 start = place + normal * 0.5;
    vec2 middle = (heights_clip * vec4(start, 1.0)).xy;
    vec2 east = (heights_clip * vec4(1.0, 0.0, 0.0, 0.0)).xy;
    vec2 north = (heights_clip * vec4(0.0, 1.0, 0.0, 0.0)).xy;
    if (max(abs(middle.x), abs(middle.y)) > 1.0 - 2.0 * EDGE / heights_side) return 1.0;
    float seen = 0.0, weights = 0.0;
    for (int side = 0; side < 3; ++side) {
        float angle = 2.0944 * (float(side) + turn);
        vec2 towards = vec2(cos(angle), sin(angle));
        float weight = max(0.05 + abs(normal.z) + 2.0 * dot(towards, normal.xy), 0.0);
        float steepest = 0.0;
        for (int ring = 0; ring < 6; ++ring) {
            vec2 at = middle + (towards.x * east + towards.y * north) * DISTANCES[ring];
            float depth = textureLod(height_map, 0.5 * at + 0.5, 0.0).r;
            float height = heights_range.x - (depth - 0.5) * heights_range.y;
            steepest = max(steepest, NEARER * (height - start.z) / DISTANCES[ring]);
        }
        // Level ground sees the share cos^2 of the sky above a horizon; a wall depends more on the
        // low sky: the integral of cos^2 from the horizon to the zenith.
        float level = 1.0 / (1.0 + steepest * steepest);
        float upright = 1.0 - 0.6366 * (atan(steepest) + steepest * level);
        seen += weight * mix(upright, level, abs(normal.z));
        weights += weight;
    }
    return weights > 0.0 ? seen / weights : 1.0;
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
    share_out.g = max(sky_share(camera_axes * place, camera_axes * normal, turn), 0.15);
}
