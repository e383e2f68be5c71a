#version 450 core
// Half the colour of a pixel's centre and an eighth of that of each corner; corners without a
// colour have the pixel's colour. Around foliage with gaps narrower than a pixel, a sample shows
// either a twig or what is behind; there, the mean reaches into the neighbours, as in a real lens.
layout(location = 0) out vec4 colour_out;

uniform sampler2D centres;
uniform sampler2D corners;

vec4 centre_at(ivec2 pixel) {
    return texelFetch(centres, clamp(pixel, ivec2(0), textureSize(centres, 0) - 1), 0);
}

// Weights 1 2 1 of centres in both directions, and 1 3 3 1 of corners.
vec3 wide_mean(ivec2 pixel) {
    vec3 sum = vec3(0.0);
    for (int y = -1; y < 2; ++y)
        for (int x = -1; x < 2; ++x)
            sum += float((2 - abs(x)) * (2 - abs(y))) / 16.0 * centre_at(pixel + ivec2(x, y)).rgb;
    for (int y = -1; y < 3; ++y)
        for (int x = -1; x < 3; ++x) {
            ivec2 place = clamp(pixel + ivec2(x, y), ivec2(0), textureSize(corners, 0) - 1);
            vec4 corner = texelFetch(corners, place, 0);
            vec3 colour = corner.a > 0.0 ? corner.rgb : centre_at(min(place, pixel + 1)).rgb;
            vec2 weight = mix(vec2(1.0), vec2(3.0), equal(ivec2(x, y) >> 1, ivec2(0)));
            sum += weight.x * weight.y / 64.0 * colour;
        }
    return 0.5 * sum;
}

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec3 centre = texelFetch(centres, pixel, 0).rgb;
    float least = 0.0;
    for (int y = -1; y < 2; ++y)
        for (int x = -1; x < 2; ++x) least = min(least, centre_at(pixel + ivec2(x, y)).a);
    if (least < 0.0) {
        colour_out = vec4(wide_mean(pixel), 1.0);
        return;
    }
    vec3 sum = 4.0 * centre;
    for (int y = 0; y < 2; ++y)
        for (int x = 0; x < 2; ++x) {
            vec4 corner = texelFetch(corners, pixel + ivec2(x, y), 0);
            sum += corner.a > 0.0 ? corner.rgb : centre;
        }
    colour_out = vec4(sum / 8.0, 1.0);
}
