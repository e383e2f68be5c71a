#version 450 core
// UsdPreviewSurface (metallic workflow) in sunlight and skylight, with shadows and haze.
// Constants of a variant: is_foliage, uses_surface_map, uses_emission_map (0 or 1), uses_vertex_colour (1 as the colour,
// 2 as a tint), those of surface_noise.glsl, wetness and lamp_count where they are 0, and SUNLESS.
// Software renderers run both sides of a condition.
#include "sky.glsl"
#include "lamps.glsl"
#include "surface_noise.glsl"
#include "texture_bombing.glsl"
#include "surface_wear.glsl"
in vec3 world_position;
in vec3 world_normal;
in vec2 texture_uv;
in vec3 mesh_colour;
layout(location = 0) out vec4 colour_out;

uniform sampler2D colour_map;
uniform vec3 mean_colour;  // of the whole texture
uniform sampler2D surface_map;
uniform sampler2DShadow shadow_near;
uniform sampler2DShadow shadow_far;
uniform mat4 shadow_clip_near;
uniform mat4 shadow_clip_far;
uniform vec2 shadow_texel;  // size of a texel in each shadow map, metres
uniform vec3 base_colour;
uniform vec3 emissive;  // in the unit of the lamps; multiplies its texture
uniform sampler2D emission_map;
uniform float lamp_unit;  // radiance of a luminous surface of 1 on the stage
uniform float metallic;
uniform float plain_roughness;
uniform float haze;  // extinction of the air, 1/m
#ifndef wetness
uniform float wetness;  // share of the ground that water covers
#endif
uniform sampler2D occlusion_map;

float lattice(ivec2 cell) {
    uint n = uint(cell.x) * 1597334677u ^ uint(cell.y) * 3812015801u;
    n = (n ^ (n >> 15)) * 2246822519u;
    return float((n ^ (n >> 13)) & 0xffffffu) / 16777215.0;
}

float smooth_noise(vec2 place) {
    ivec2 cell = ivec2(floor(place));
    vec2 f = place - vec2(cell);
    f = f * f * (3.0 - 2.0 * f);
    float low = mix(lattice(cell), lattice(cell + ivec2(1, 0)), f.x);
    float high = mix(lattice(cell + ivec2(0, 1)), lattice(cell + ivec2(1, 1)), f.x);
    return mix(low, high, f.y);
}

// Depth of the ground's hollows at a place in metres, 0 to 1.
float puddle(vec2 place) {
    return 0.55 * smooth_noise(0.35 * place) + 0.3 * smooth_noise(1.1 * place)
        + 0.15 * smooth_noise(4.3 * place);
}

// Several samples along the longer side of a pixel's footprint keep roads sharp at grazing angles.
// Anisotropic filters differ between drivers, and that of some Mesa llvmpipe versions never ends.
// A pixel takes one of the two mipmaps around its level, the nearer one more often: half the texels
// of a mean of both (M. Fajardo and others, "Stochastic texture filtering", 2023).
struct Footprint {
    vec2 major;  // the longer side, in repeats of the texture
    float looks;
    float level;  // of the mipmaps
};

// A share of 0 to 1 that differs between neighbours: J. Jimenez, "Next generation post processing in
// Call of Duty: Advanced Warfare" (2014).
float dither() {
    return fract(52.9829189 * fract(dot(gl_FragCoord.xy, vec2(0.06711056, 0.00583715))));
}

float mipmap_of(float longest) {
    return floor(log2(max(longest, 1e-6)) + dither());
}

Footprint footprint_of(vec2 along_x, vec2 along_y, vec2 size) {
    float size_x = length(along_x * size), size_y = length(along_y * size);
    float longer = max(max(size_x, size_y), 1e-6), shorter = max(min(size_x, size_y), 1e-6);
    float looks = clamp(ceil(longer / max(shorter, 1.0)), 1.0, 4.0);
    return Footprint(
        size_x > size_y ? along_x : along_y, looks, mipmap_of(longer / looks));
}

// No texel is read with 0 looks.
vec4 texel_of(sampler2D map, vec2 uv, vec2 major, float looks, float level) {
    vec4 sum = vec4(0.0);
    for (float look = 0.5; look < looks; look += 1.0)
        sum += textureLod(map, uv + major * (look / looks - 0.5), level);
    return sum / max(looks, 1.0);
}

// Colour, and normal with roughness, at a place of the textures. Patches keep the contrast of the
// texture, which a plain mean of several patches would lose.
void read_maps(vec2 uv, uint seed, out vec3 colour, out vec4 mapped) {
    vec2 along_x = dFdx(uv), along_y = dFdy(uv);
    vec2 size = vec2(textureSize(colour_map, 0)), relief_size = vec2(textureSize(surface_map, 0));
    Footprint seen = footprint_of(along_x, along_y, size);
    float longest = max(length(along_x * relief_size), length(along_y * relief_size));
    float relief_level = mipmap_of(longest);
#ifdef BRICKS
    uv = brick_patch(uv, seed);
#endif
#ifndef PATCHES
    colour = texel_of(colour_map, uv, seen.major, seen.looks, seen.level).rgb;
    mapped = vec4(0.5, 0.5, 1.0, plain_roughness);
    WHERE(uses_surface_map != 0) mapped = textureLod(surface_map, uv, relief_level);
#else
    // Where a pixel takes several samples, each patch has its share of them; else all are blended.
    // A texture that a few pixels cover shows no pattern that could repeat.
    bool near = seen.level < log2(size.x) - 2.0, divided = seen.looks > 1.0;
    vec3 weights;
    for (int corner = 0; corner < 3; ++corner) corner_around(uv, corner, weights[corner]);
    float heaviest = max(weights.x, max(weights.y, weights.z));
    weights = max(weights - NARROW, 0.0);
    weights /= dot(weights, vec3(1.0));
    vec3 colours = vec3(0.0);
    vec2 sums = vec2(0.0);
    float before = 0.0;
    mapped = vec4(0.5, 0.5, 1.0, plain_roughness);
    for (int corner = 0; corner < (near ? 3 : 1); ++corner) {
        float weight, share = near ? weights[corner] : 1.0;
        ivec2 cell = corner_around(uv, corner, weight);
        vec2 turn, place = turned_patch(uv, cell, seed, turn);
        vec2 major = vec2(turn.x * seen.major.x - turn.y * seen.major.y,
            turn.y * seen.major.x + turn.x * seen.major.y);
        float first = divided ? ceil(before * seen.looks - 0.5) : 0.0;
        before += share;
        float last = divided ? ceil(before * seen.looks - 0.5) : share > 0.0 ? 1.0 : 0.0;
        float counted = divided ? (last - first) / seen.looks : share;
        vec3 sum = vec3(0.0);
        for (float look = first + 0.5; look < last; look += 1.0)
            sum += textureLod(colour_map, place + major * (look / seen.looks - 0.5), seen.level).rgb;
        colours += sum * counted / max(last - first, 1.0);
        sums += vec2(counted, counted * counted);
        WHERE(uses_surface_map != 0 && (weight == heaviest || !near)) {
            mapped = textureLod(surface_map, place, relief_level);
            vec2 there = mapped.xy - 0.5;
            mapped.xy = 0.5 + vec2(dot(turn, there), turn.x * there.y - turn.y * there.x);
        }
    }
    float gain = sums.x * inversesqrt(max(sums.y, 1e-6));
    vec3 raised = mean_colour + gain * (colours / max(sums.x, 1e-6) - mean_colour);
    colour = max(raised, 0.25 * mean_colour);
#endif
}

vec3 from_srgb(vec3 c) {
    return mix(c / 12.92, pow((c + 0.055) / 1.055, vec3(2.4)), greaterThan(c, vec3(0.04045)));
}

// Perturbs the normal without stored tangents: C. Schueler, "Followup: normal mapping without
// precomputed tangents" (2013).
vec3 bumped(vec3 normal, vec3 mapped) {
    vec3 along_x = dFdx(world_position), along_y = dFdy(world_position);
    vec2 uv_x = dFdx(texture_uv), uv_y = dFdy(texture_uv);
    vec3 side_x = cross(along_y, normal), side_y = cross(normal, along_x);
    vec3 tangent = side_x * uv_x.x + side_y * uv_y.x;
    vec3 bitangent = side_x * uv_x.y + side_y * uv_y.y;
    float size = max(dot(tangent, tangent), dot(bitangent, bitangent));
    if (size <= 0.0) return normal;
    float unit = inversesqrt(size);
    return normalize(mat3(tangent * unit, bitangent * unit, normal) * mapped);
}

// Mean of three by three filtered comparisons, of the 16 texels that they weigh. No texel is read
// where `share` is 0.
float lit_share(sampler2DShadow map, vec3 place, float share) {
    vec2 size = vec2(textureSize(map, 0));
    vec2 texel = place.xy * size - 0.5;
    vec2 low = floor(texel), f = texel - low;
    float sum = 0.0;
    int looks = share > 0.0 ? 4 : 0;
    for (int look = 0; look < looks; ++look) {
        vec2 side = vec2(look & 1, look >> 1);
        // The outer texels of a row weigh 1 - f and f, the inner ones 1.
        vec2 first = mix(1.0 - f, vec2(1.0), side), second = mix(vec2(1.0), f, side);
        vec4 lit = textureGather(map, (low + 2.0 * side) / size, place.z);
        sum += second.y * (first.x * lit.x + second.x * lit.y)
            + first.y * (second.x * lit.z + first.x * lit.w);
    }
    return sum / 9.0;
}

float inside(vec3 place) {
    vec2 edge = abs(place.xy - 0.5);
    return 1.0 - smoothstep(0.46, 0.49, max(edge.x, edge.y));
}

// Visible share of the sun; the lookup is offset from the surface by about a shadow texel.
float sunlit(vec3 normal, float facing) {
    float slope = 1.0 + 1.5 * sqrt(max(1.0 - facing * facing, 0.0));
    vec3 lifted = world_position + normal * shadow_texel.x * slope;
    vec3 place = (shadow_clip_near * vec4(lifted, 1.0)).xyz * vec3(0.5, 0.5, 1.0);
    place += vec3(0.5, 0.5, 0.0);
    // Ground far below a high camera lies behind the maps: nothing shades it.
    place.z = min(place.z, 1.0);
    float near_share = inside(place);
    lifted = world_position + normal * shadow_texel.y * slope;
    vec3 far = (shadow_clip_far * vec4(lifted, 1.0)).xyz * vec3(0.5, 0.5, 1.0);
    far += vec3(0.5, 0.5, 0.0);
    far.z = min(far.z, 1.0);
    float far_share = near_share < 1.0 ? inside(far) : 0.0;
    float lit = mix(1.0, lit_share(shadow_far, far, far_share), far_share);
    return mix(lit, lit_share(shadow_near, place, near_share), near_share);
}

vec3 gloss(vec3 light, vec3 normal, vec3 view, vec3 f0, float roughness, float facing) {
    vec3 half_way = normalize(view + light);
    float a = roughness * roughness, a2 = a * a;
    float nh = max(dot(normal, half_way), 0.0), nv = max(dot(normal, view), 1e-3);
    float d = nh * nh * (a2 - 1.0) + 1.0;
    float k = 0.5 * a;
    float visible = 1.0 / (4.0 * mix(facing, 1.0, k) * mix(nv, 1.0, k));
    vec3 fresnel = f0 + (1.0 - f0) * pow(1.0 - clamp(dot(view, half_way), 0.0, 1.0), 5.0);
    return fresnel * min(a2 / (d * d) * visible, 40.0) * facing;
}

const float LAMP_RANGE = 60.0;  // metres: a lamp lights nothing farther, 1 % of its light at 6 m
const float LAMP_FADES = 0.5;  // share of the square of the range from which its light fades
const float LAMP_SIZE = 0.2;  // radius of lamps, metres: none has a highlight as small as a point's

// Share of a lamp's light that a surface sends to the view; `away` is the way to the lamp.
vec3 shone(vec3 away, vec3 towards, vec3 normal, vec3 view, vec3 matt, vec3 f0, float roughness) {
    float turned = max(dot(normal, towards), 0.0);
    float spread = sqrt(min(roughness * roughness + 0.5 * LAMP_SIZE / length(away), 1.0));
    return matt * turned + gloss(towards, normal, view, f0, spread, turned);
}

// Roughness of a mean of the pixel's normals: Y. Tokuyoshi and A. Kaplanyan, "Improved geometric
// specular antialiasing" (2019). Without it, wet ground glitters under lamps.
float smoothed_roughness(float roughness, vec3 along_x, vec3 along_y) {
    float variance = 0.25 * (dot(along_x, along_x) + dot(along_y, along_y));
    float a2 = roughness * roughness * roughness * roughness + min(2.0 * variance, 0.18);
    return sqrt(sqrt(min(a2, 1.0)));
}

const float CROWN = 0.65;  // share of the sky that the leaves around a leaf at the top leave to it
const float FAR_LEAVES = 0.65;  // mean share of the sky around leaves, for those beyond the map of heights
const float KNOWN = 0.995;  // larger shares of the sky stand for what lies beyond; see occlusion.frag
const float BARE = 0.8;  // the same among bare twigs
const float ROUND = 0.55;  // light of the sun that round twigs turn to us, of what flat ones would
const float RIM = 0.25;  // the same of a sun behind them
const vec3 LEAF = vec3(0.5, 0.5, 0.25);  // light that leaves let through, of what they reflect

// Share of even light that a surface mirrors: B. Karis, "Physically based shading on mobile" (2014),
// after D. Lazarov (2013). Roads mirror the sky above the horizon, however rough they are.
vec3 mirrored_share(vec3 f0, float roughness, float turned) {
    vec4 r = roughness * vec4(-1.0, -0.0275, -0.572, 0.022) + vec4(1.0, 0.0425, 1.04, -0.04);
    float a = min(r.x * r.x, exp2(-9.28 * turned)) * r.x + r.y;
    return f0 * (r.z - 1.04 * a) + (r.w + 1.04 * a);
}

// Water darkens porous ground (S. Lagarde, "Water drop", 2013), and its film evens out what it
// covers: it gathers in hollows and ruts, and runs off what is higher. Sidewalks hold less of it than
// roads, and loose ground lets it in: what is rough when dry, or wears no stains (grass, soil).
// `film` is the share of the surface that is wet.
void wet_ground(
    float film, vec3 flat_normal, float rut, inout vec3 albedo, inout float roughness, inout vec3 normal
) {
#if defined(GROUND) && !defined(LANES)
    float sealed = 0.75 * (1.0 - smoothstep(0.88, 0.95, roughness));
#elif defined(PATCHES) && !defined(GROUND)
    float sealed = 0.0;
#else
    float sealed = 1.0;
#endif
    float deep = puddle(world_position.xy + eye_place) + 0.10 * rut;
    float soaked = smoothstep(0.77 - 0.30 * wetness, 1.07 - 0.30 * wetness, deep + 0.15 * sealed);
    float filled = deep - 0.22 * (1.0 - sealed);
    float pool = film * smoothstep(1.02 - 0.5 * wetness, 1.1 - 0.45 * wetness, filled);
    albedo *= mix(1.0, mix(0.68, 0.42, soaked), film * (1.0 - metallic));
    float damp = mix(0.75, mix(0.52, 0.27, soaked), sealed);
    roughness = mix(roughness, mix(min(damp, roughness), 0.03, pool), film);
    normal = normalize(mix(normal, flat_normal, max(0.6 * film * sealed * soaked, pool)));
}

void main() {
    vec3 tint = uses_vertex_colour != 0 ? from_srgb(mesh_colour) : vec3(1.0);
    uint drawn = uint(dot(floor(mesh_colour * 255.0 + 0.5), vec3(1.0, 256.0, 65536.0)));
    vec3 albedo;
    vec4 mapped;
    read_maps(texture_uv, uses_vertex_colour == 2 ? drawn : 0u, albedo, mapped);
    albedo = uses_vertex_colour == 1 ? tint : albedo * base_colour * tint;
    vec3 flat_normal = normalize(world_normal) * (gl_FrontFacing ? 1.0 : -1.0);
    vec3 normal = flat_normal;
    float roughness = mapped.a;
    if (uses_surface_map != 0) normal = bumped(flat_normal, mapped.xyz * 2.0 - 1.0);
#if defined(GROUND) || defined(WALL)
    vec3 side_x = dFdx(world_position), side_y = dFdy(world_position);
    vec2 sides = vec2(length(side_x), length(side_y));
    vec2 spread = vec2(max(sides.x, sides.y), min(sides.x, sides.y));
#endif
    float rut = 0.0;
#ifdef GROUND
    WHERE(flat_normal.z > 0.5) wear_ground(world_position, spread, albedo, roughness, rut);
#endif
#ifdef WALL
    WHERE(abs(flat_normal.z) < 0.5) wear_wall(texture_uv, float(drawn % 4093u), spread, albedo);
#endif
    float film = wetness * smoothstep(0.5, 0.9, flat_normal.z) * (1.0 - float(is_foliage));
    WHERE(film > 0.0) wet_ground(film, flat_normal, rut, albedo, roughness, normal);
    vec3 view = normalize(-world_position);
    float facing = max(dot(normal, sun_direction), 0.0);
    float behind = float(is_foliage) * max(-dot(normal, sun_direction), 0.0);
    float lit = 0.0;
#ifndef SUNLESS
    if (facing + behind > 0.0)
        lit = sunlit(facing > 0.0 ? flat_normal : -flat_normal, facing + behind);
#endif
    vec3 f0 = mix(vec3(0.04), albedo, metallic);
    float turned_to_us = clamp(dot(normal, view), 0.0, 1.0);
    // Rough surfaces brighten where one looks along them: B. Burley (SIGGRAPH course, 2012).
    float edge = 1.0 + (roughness - 0.5) * pow(1.0 - turned_to_us, 5.0);
    float smooth_share = (1.0 - roughness) * (1.0 - roughness);
    vec3 mirrored = reflect(-view, normal);
    vec2 open = texelFetch(occlusion_map, ivec2(gl_FragCoord.xy), 0).rg;
    if (is_foliage != 0 && open.g > KNOWN) open.g = FAR_LEAVES;
    vec3 ambient = open.r * ambient_light(normal, open.g);
    float dense = 0.0;  // 1 for leaves, 0 for bare twigs
    vec3 through = vec3(0.0);  // even light on the other side of a leaf
    if (is_foliage != 0) {
        dense = smoothstep(0.15, 0.5, textureLod(colour_map, texture_uv, 5.0).a);
        ambient *= mix(BARE, CROWN, dense);
        through = dense * CROWN * open.r * ambient_light(-normal, open.g);
        facing *= mix(ROUND, 1.0, dense);
    }
    // Panes mirror the houses opposite below the sine of their horizon, the sky above it.
    float horizon = (1.0 - open.g) * (1.0 - abs(normal.z));
    float sky_seen = mirrored.z > 0.0 ? smoothstep(horizon - 0.2, horizon, mirrored.z) : 0.0;
    vec3 around = mix(bounced_light, sky_radiance(mirrored, 0.9 * roughness), sky_seen);
    vec3 light = albedo * (1.0 - metallic) * edge * (ambient + sun_light * facing * lit);
    vec3 share = mirrored_share(f0, roughness, turned_to_us);
    light += share * mix(ambient, around * open.r, smooth_share);
    light += mix(vec3(RIM), LEAF, dense) * albedo * (sun_light * behind * lit + through);
    if (facing * lit > 0.0)
        light += lit * sun_light
            * gloss(sun_direction, normal, view, f0, max(roughness, 0.05), facing);
#ifndef lamp_count
    float glossy = smoothed_roughness(max(roughness, 0.05), dFdx(normal), dFdy(normal));
    for (int lamp = 0; lamp < lamp_count; ++lamp) {
        vec3 away = lamp_places[lamp] - world_position;
        float left = 1.0 - dot(away, away) / (LAMP_RANGE * LAMP_RANGE);
        WHERE(left > 0.0 && dot(away, normal) > 0.0) {
            vec3 towards, power = lamplight(lamp, world_position, towards);
            light += power * min(left / (1.0 - LAMP_FADES), 1.0)
                * shone(away, towards, normal, view, albedo * (1.0 - metallic), f0, glossy);
        }
    }
    for (int lamp = 0; lamp < headlamp_count; ++lamp) {
        vec3 away = headlamp_places[lamp] - world_position;
        WHERE(dot(away, normal) > 0.0) {
            vec3 towards, power = headlight(lamp, world_position, towards);
            light += power
                * shone(away, towards, normal, view, albedo * (1.0 - metallic), f0, glossy);
        }
    }
#endif
    if (uses_emission_map != 0) light += emissive * lamp_unit * texture(emission_map, texture_uv).rgb;
    else light += emissive * lamp_unit;
    float seen = exp(-haze * length(world_position));
    // Haze has the colour of the sky above the horizon in the direction of the view.
    vec3 level = normalize(vec3(world_position.xy, 0.15 * length(world_position.xy)));
    // Wet ground tells wet_mirror.frag the share of mirrored light.
    float mirror = film > 0.0 ? seen * open.r * share.g * smooth_share : 0.0;
    colour_out = vec4(mix(sky_radiance(level, 0.15), light, seen), mirror);
}
