// Runs a block where a condition holds. Software renderers run both sides of an `if` for all pixels,
// but leave a loop at once where no pixel needs it. What a material needs or not is told to the
// preprocessor: PATCHES or BRICKS, GROUND, LANES, PAINT, WALL.
#define WHERE(condition) for (int times = int(condition); times > 0; --times)

// Random figures and noise on the plane. Cells wrap around, so that places repeat without a seam.
uvec3 mixed_bits(ivec2 cell, uint seed) {
    uint n = uint(cell.x) * 1597334677u ^ uint(cell.y) * 3812015801u ^ seed * 2798796415u;
    n = (n ^ (n >> 15)) * 2246822519u;
    uint a = (n ^ (n >> 13)) * 3266489917u;
    uint b = (a ^ (a >> 16)) * 668265263u;
    uint c = (b ^ (b >> 15)) * 374761393u;
    return uvec3(a ^ (a >> 16), b ^ (b >> 15), c ^ (c >> 14));
}

// Three figures from 0 to 1 for a cell.
vec3 random_of(ivec2 cell, uint seed) {
    return vec3(mixed_bits(cell, seed) & 0xffffffu) / 16777215.0;
}

float corner_value(ivec2 cell) {
    uint n = uint(cell.x) * 1597334677u ^ uint(cell.y) * 3812015801u;
    n = (n ^ (n >> 15)) * 2246822519u;
    return float((n ^ (n >> 13)) & 0xffffffu) / 16777215.0;
}

// Value noise from 0 to 1 with cells of side 1, which repeat after `period` cells, a power of two.
float even_noise(vec2 place, int period) {
    ivec2 low = ivec2(floor(place)), last = ivec2(period - 1);
    vec2 f = place - vec2(low);
    f = f * f * (3.0 - 2.0 * f);
    ivec2 near = low & last, far = (low + 1) & last;
    float lower = mix(corner_value(near), corner_value(ivec2(far.x, near.y)), f.x);
    float upper = mix(corner_value(ivec2(near.x, far.y)), corner_value(far), f.x);
    return mix(lower, upper, f.y);
}
