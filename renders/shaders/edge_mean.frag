#version 450 core
// Half the colour of a pixel's centre and an eighth of that of each corner; corners without a
// colour have the pixel's colour.
layout(location = 0) out vec4 colour_out;

uniform sampler2D centres;
uniform sampler2D corners;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec3 centre = texelFetch(centres, pixel, 0).rgb, sum = 4.0 * centre;
    for (int i = 0; i < 4; ++i) {
        vec4 corner = texelFetch(corners, pixel + ivec2(i & 1, i >> 1), 0);
        sum += corner.a > 0.0 ? corner.rgb : centre;
    }
    colour_out = vec4(sum / 8.0, 1.0);
}
