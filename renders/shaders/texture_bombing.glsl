// Texture bombing: random patches of a texture, turned and shifted, in place of its repeats. After
// E. Heitz, F. Neyret, "High-performance by-example noise using a histogram-preserving blending
// operator" (2018), and M. Mikkelsen, "Practical real-time hex-tiling" (2022).
uniform float patch_side;  // distance of the patches, repeats of the texture; 0 for no patches
uniform float patch_turn;  // largest turn of a patch, radians
uniform vec2 patch_unit;  // brick that no patch divides, share of the texture; 0 for any shift
uniform float patch_bond;  // shift of every second course, share of a brick
const float UV_PERIOD = 256.0;  // repeats after which texture coordinates may start anew
const float NARROW = 0.28;  // share of the weights that is cut off; a larger one blends less

// The corner, one of three, of the triangle around a place: a cell of a lattice and its weight.
ivec2 corner_around(vec2 uv, int corner, out float weight) {
    vec2 place = uv / patch_side;
    vec2 skewed = vec2(place.x - 0.5 * place.y, place.y);
    vec2 low = floor(skewed), f = skewed - low;
    bool upper = f.x + f.y > 1.0;
    float middle = upper ? f.x + f.y - 1.0 : 1.0 - f.x - f.y;
    vec2 others = upper ? 1.0 - f.yx : f;
    weight = corner == 0 ? middle : corner == 1 ? others.x : others.y;
    return ivec2(low) + (corner == 0 ? ivec2(upper) : ivec2(corner & 1, corner >> 1));
}

vec3 patch_figures(ivec2 cell, uint seed) {
    int rows = max(int(UV_PERIOD / patch_side + 0.5), 1);
    ivec2 steps = ivec2(2 * cell.x + cell.y, cell.y), period = ivec2(2 * rows, rows);
    return random_of((steps % period + period) % period, seed);
}

// Coordinates in the patch of a corner, and cosine and sine of its turn.
vec2 turned_patch(vec2 uv, ivec2 cell, uint seed, out vec2 turn) {
    vec3 figures = patch_figures(cell, seed);
    float angle = patch_turn * (2.0 * figures.z - 1.0);
    turn = vec2(cos(angle), sin(angle));
    vec2 from = uv - patch_side * vec2(float(cell.x) + 0.5 * float(cell.y), cell.y);
    return figures.xy + vec2(turn.x * from.x - turn.y * from.y, turn.y * from.x + turn.x * from.y);
}

// Coordinates in the patch of the brick at a place: whole bricks are shifted, none is divided.
vec2 brick_patch(vec2 uv, uint seed) {
    float course = floor(uv.y / patch_unit.y), odd = mod(course, 2.0);
    float column = floor(uv.x / patch_unit.x + patch_bond * odd);
    vec2 middle = (vec2(column - patch_bond * odd, course) + 0.5) * patch_unit;
    float weight_0, weight_1, weight_2;
    ivec2 cell = corner_around(middle, 0, weight_0);
    ivec2 cell_1 = corner_around(middle, 1, weight_1), cell_2 = corner_around(middle, 2, weight_2);
    cell = weight_1 > max(weight_0, weight_2) ? cell_1
        : weight_2 > max(weight_0, weight_1) ? cell_2 : cell;
    vec2 steps = floor(patch_figures(cell, seed).xy / patch_unit);
    float odd_there = mod(course + steps.y, 2.0);
    return uv + (steps + vec2(patch_bond * (odd - odd_there), 0.0)) * patch_unit;
}
