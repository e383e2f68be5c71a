// Wear and dirt: nothing is stored for a place, all follows from where it is. On the ground that is
// the place in the world and in the lane, on walls the height above the foot.
uniform vec4 wear;  // of lanes, stains on the ground, dirt at the foot of walls, streaks; 0 to 1
uniform float paint_wear;  // share of paint that traffic takes off, 0 to 1
uniform float tile_size;  // side of the texture, metres
uniform vec2 eye_place;  // the camera's place in a square of 512 m, metres
uniform usampler2D lane_map;  // s and t (float bits), direction of the lane (halves), height
uniform vec3 lane_map_corner;  // lower corner relative to the camera, and side of a texel, metres
const vec3 BARE_ROAD = vec3(0.09, 0.088, 0.084);
const vec3 IRON = vec3(0.06, 0.057, 0.054);
const vec3 SOIL = vec3(0.62, 0.58, 0.52);

// How much a feature of this size still shows where a pixel covers `footprint`, both metres.
float visible(float size, float footprint) {
    return 1.0 - smoothstep(0.35 * size, 1.2 * size, footprint);
}

// Cover of a line; one narrower than a pixel fades instead of breaking up.
float line(float apart, float half_width, float footprint) {
    float wide = max(half_width, 0.6 * footprint);
    return half_width / wide * (1.0 - smoothstep(0.6 * wide, 1.4 * wide, apart));
}

// s along the lane and t to its left, metres, and the share to which they are known.
vec3 lane_place(vec3 position) {
    vec2 place = (position.xy - lane_map_corner.xy) / lane_map_corner.z;
    ivec2 texel = ivec2(floor(place)), side = textureSize(lane_map, 0);
    if (any(lessThan(texel, ivec2(0))) || any(greaterThanEqual(texel, side))) return vec3(0.0);
    uvec4 stored = texelFetch(lane_map, texel, 0);
    vec4 known = uintBitsToFloat(stored);
    if (abs(known.w - position.z) > 1.5) return vec3(0.0);
    vec2 along = unpackHalf2x16(stored.z), apart = (place - vec2(texel) - 0.5) * lane_map_corner.z;
    vec2 edge = min(place, vec2(side) - place) * lane_map_corner.z;
    float share = smoothstep(0.0, 20.0, min(edge.x, edge.y));
    return vec3(known.x + dot(apart, along),
        known.y + dot(apart, vec2(-along.y, along.x)), share);
}

// Signed distance from the border of a rectangle, negative inside.
float outside(vec2 place, vec2 middle, vec2 half_size) {
    vec2 beyond = abs(place - middle) - half_size;
    return max(beyond.x, beyond.y);
}

void lay_repair(inout vec3 albedo, float border, float tone, float footprint) {
    float edge = max(0.02, 0.7 * footprint);
    albedo *= mix(1.0, tone, 1.0 - smoothstep(-edge, edge, border));
    albedo *= 1.0 - 0.55 * line(abs(border), 0.018, footprint);
}

// Repairs, trenches and manholes: a cell along the lane has each or has it not.
void repair_lane(
    vec2 lane, float amount, float footprint, inout vec3 albedo, inout float roughness
) {
    int cell = int(floor(lane.x / 17.0));
    vec3 first = random_of(ivec2(cell, 11), 1u), second = random_of(ivec2(cell, 12), 1u);
    vec2 place = vec2(mod(lane.x, 17.0), lane.y);
    WHERE(first.x < 0.55 * amount) {
        vec2 half_size = vec2(0.5 + 3.0 * first.y * first.y, 0.35 + 0.6 * first.z);
        vec2 middle = vec2(4.0 + 9.0 * second.x, (1.2 - half_size.y) * (2.0 * second.y - 1.0));
        lay_repair(albedo, outside(place, middle, half_size), mix(0.68, 1.16, second.z), footprint);
    }
    vec3 third = random_of(ivec2(cell, 13), 1u);
    WHERE(third.x < 0.30 * amount) {
        float side = abs(place.x - 1.5) - mix(0.22, 0.45, third.y);
        lay_repair(albedo, side, mix(0.70, 1.10, third.z), footprint);
    }
    vec3 fourth = random_of(ivec2(cell, 14), 1u);
    WHERE(fourth.x < 0.40) {
        vec2 from = place - vec2(14.0 + fourth.z, 1.4 * fourth.y - 0.7);
        float radius = length(from), edge = max(0.01, 0.7 * footprint);
        float cover = 1.0 - smoothstep(0.33 - edge, 0.33 + edge, radius);
        vec2 stud = abs(fract(from * 12.0) - 0.5);
        float shown = visible(0.08, footprint);
        float relief = mix(1.0, 0.75 + 0.9 * step(stud.x + stud.y, 0.42), shown);
        albedo = mix(albedo, IRON * relief, cover);
        albedo *= 1.0 - 0.6 * line(abs(radius - 0.33), 0.012, footprint);
        roughness = mix(roughness, 0.45, cover);
        lay_repair(albedo, abs(radius - 0.44) - 0.11, 0.86, footprint);
    }
}

// Cracks: along a lane where two strips were laid, and across the surface where it is old.
float cracked(vec2 lane, float known, vec2 place, float footprint) {
    float wobble = even_noise(place, 512) - 0.5;
    float jagged = even_noise(place * 8.0, 4096) - 0.5;
    float old = smoothstep(0.52, 0.60, even_noise(place * 0.25 + 0.3, 128));
    float web = abs(even_noise(place * 0.5 + 0.5 * wobble, 256) - 0.5 + 0.03 * jagged) * 1.4;
    float crack = old * line(web, 0.004, footprint);
    vec3 drawn = random_of(ivec2(int(floor(lane.x / 61.0)), 15), 1u);
    float joint = abs(lane.y - mix(-1.6, 1.6, drawn.y) - 0.18 * wobble - 0.03 * jagged);
    float sealed = drawn.z < 0.3 ? 0.025 : 0.005;
    return max(crack, drawn.x < 0.45 ? known * line(joint, sealed, footprint) : 0.0);
}

// Traffic in lanes: tyre tracks, a darker middle, worn paint, repairs and cracks. `rut` is 1 where
// wheels have worn the surface down.
void wear_lane(vec3 position, vec2 place, vec2 spread, float middle, float fine,
        inout vec3 albedo, inout float roughness, inout float rut) {
    vec3 lane = lane_place(position);
    float off = (abs(lane.y) - 0.8) / 0.28, footprint = sqrt(spread.x * spread.y);
    float track = lane.z * exp(-off * off), between = lane.z * exp(-lane.y * lane.y / 0.12);
    albedo *= 1.0 + wear.x * (0.16 * track * (1.0 + middle) - 0.20 * between * (0.8 + 2.0 * middle));
    roughness -= 0.12 * wear.x * track;
    rut = wear.x * track;
#ifdef PAINT
    float flakes = mix(0.5, even_noise(place * 32.0, 16384), visible(0.05, spread.x));
    float gone = paint_wear * (0.50 + 0.40 * track + 1.2 * middle + 0.3 * fine);
    albedo = mix(albedo, BARE_ROAD, smoothstep(1.0 - gone, 1.25 - gone, flakes));
#else
    WHERE(visible(0.6, footprint) > 0.0) {
        WHERE(lane.z > 0.0) repair_lane(lane.xy, wear.x, footprint, albedo, roughness);
        albedo *= 1.0 - 0.75 * wear.x * cracked(lane.xy, lane.z, place, footprint);
    }
#endif
}

void wear_ground(
    vec3 position, vec2 spread, inout vec3 albedo, inout float roughness, inout float rut
) {
    vec2 place = position.xy + eye_place;
    float broad = even_noise(place * 0.0625, 32) - 0.5, middle = even_noise(place * 0.25, 128) - 0.5;
    float fine = 0.0, spots = 0.0;
    WHERE(visible(0.5, spread.x) > 0.0) {
        fine = (even_noise(place * 2.0, 1024) - 0.5) * visible(0.5, spread.x);
        spots = smoothstep(0.74, 0.86, even_noise(place * 4.0 + 0.5, 2048))
            * visible(0.25, spread.x) * smoothstep(-0.1, 0.2, middle);
    }
    albedo *= 1.0 + wear.y * (0.30 * broad + 0.30 * middle + 0.16 * fine - 0.30 * spots);
#ifdef LANES
    wear_lane(position, place, spread, middle, fine, albedo, roughness, rut);
#endif
}

const float SILL_STEP = 0.1;  // of heights in texture coordinates, as in `sill_strips.py`
const vec3 SOOT = vec3(0.40, 0.39, 0.37);
const vec3 RUST = vec3(0.62, 0.40, 0.26);

// Height of the sill above a place on a wall, metres above the foot; 0 where none is. Texture
// coordinates below sills are shifted by whole periods, whose numbers are the height's digits.
float sill_above(vec2 uv) {
    vec2 digits = floor(uv / UV_PERIOD) - 2.0;
    return min(digits.x, digits.y) < 0.0 ? 0.0 : SILL_STEP * (digits.x + 14.0 * digits.y + 1.0);
}

// Water from a sill: drips of different lengths, some of rust, that fade downwards.
// Strips of wall end a little above its foot; streaks fade towards it.
void wear_below_sill(vec2 moved, float below, float height, vec2 spread, inout vec3 albedo) {
    float fine = mix(0.5, even_noise(vec2(moved.x * 16.0, 3.5), 8192), visible(0.12, spread.x));
    float broad = even_noise(vec2(moved.x * 3.5, 9.5), 4096);
    float drip = smoothstep(0.42, 0.80, 0.5 * fine + 0.7 * broad);
    float reach = mix(0.25, 1.4, broad * (0.5 + fine));
    below = max(below, 0.0);
    float cover = 0.9 * drip * exp(-below * below / (reach * reach)) + 0.4 * exp(-below / 0.15);
    cover *= smoothstep(0.08, 0.45, height);
    float rusty = smoothstep(0.52, 0.62, even_noise(vec2(moved.x * 0.8, 21.5), 1024));
    albedo *= mix(vec3(1.0), mix(SOOT, RUST, rusty), min(1.3 * wear.w * cover, 1.0));
}

// Height above the foot and place along a wall in metres, for any repeat of the coordinates.
void wear_wall(vec2 uv, float seed, vec2 spread, inout vec3 albedo) {
    vec2 place = (fract(uv / 256.0 + 0.5) - 0.5) * 256.0 * tile_size;
    vec2 moved = place + vec2(seed, 0.0);
    float broad = even_noise(moved * 0.25, 4096);
    float splash = even_noise(moved * vec2(2.0, 1.0), 4096);
    float height = max(place.y, 0.0);
    float foot = exp(-height / 0.45) * (0.5 + 0.8 * splash) + 0.4 * exp(-height / 1.6) * broad;
    // Water runs down in streaks that begin below ledges and fade.
    float streak = even_noise(moved * vec2(5.0, 0.35), 8192) * even_noise(moved * vec2(1.5, 0.2) + 7.0, 4096);
    streak = smoothstep(0.22, 0.80, streak) * visible(0.2, spread.x);
    float soot = smoothstep(0.35, 0.8, broad);
    albedo *= mix(vec3(1.0), SOIL, min(wear.z * foot, 1.0));
    albedo *= 1.0 - wear.w * (0.32 * streak + 0.24 * soot);
    float sill = sill_above(uv);
    WHERE(sill > 0.0) wear_below_sill(moved, sill - place.y, height, spread, albedo);
}
