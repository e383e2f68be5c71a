#version 450 core
// Half the colour of a pixel's centre and an eighth of that of each corner; corners without a
// colour have the pixel's colour. Around foliage with gaps narrower than a pixel, a sample shows
// either a twig or what is behind; there, the mean reaches into the neighbours, as in a real lens.
layout(location = 0) out vec4 colour_out;

uniform sampler2D centres;
uniform sampler2D corners;  // alpha: see corner_colours.frag

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy), last = textureSize(centres, 0) - 1;
    vec3 centre = texelFetch(centres, pixel, 0).rgb, sum = 4.0 * centre, wide = vec3(0.0);
    bool hazy = false;
    for (int i = 0; i < 4; ++i) {
        vec4 corner = texelFetch(corners, pixel + ivec2(i & 1, i >> 1), 0);
        sum += abs(corner.a) > 0.75 ? corner.rgb : centre;
        hazy = hazy || corner.a < 0.0;
    }
    // Weights 1 2 1 of centres in both directions, and 1 3 3 1 of corners. Software renderers skip
    // loops, not conditions.
    int around = hazy ? 9 : 0, further = hazy ? 16 : 0;
    for (int i = 0; i < around; ++i) {
        ivec2 step = ivec2(i % 3, i / 3) - 1;
        vec3 colour = texelFetch(centres, clamp(pixel + step, ivec2(0), last), 0).rgb;
        wide += float((2 - abs(step.x)) * (2 - abs(step.y))) / 16.0 * colour;
    }
    for (int i = 0; i < further; ++i) {
        ivec2 step = ivec2(i & 3, i >> 2) - 1;
        vec3 colour = texelFetch(corners, clamp(pixel + step, ivec2(0), last + 1), 0).rgb;
        vec2 weight = mix(vec2(1.0), vec2(3.0), equal(step >> 1, ivec2(0)));
        wide += weight.x * weight.y / 64.0 * colour;
    }
    colour_out = vec4(hazy ? 0.5 * wide : sum / 8.0, 1.0);
}
