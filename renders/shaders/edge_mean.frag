#version 450 core
// Half the colour of a pixel's centre and an eighth of that of each corner; corners without a
// colour have the pixel's.
layout(location = 0) out vec4 colour_out;

uniform sampler2D centres;
uniform sampler2D corners;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec3 centre = texelFetch(centres, pixel, 0).rgb;
    vec3 sum = 4.0 * centre;
    for (int y = 0; y < 2; ++y)
        for (int x = 0; x < 2; ++x) {
            vec4 corner = texelFetch(corners, pixel + ivec2(x, y), 0);
            sum += corner.a > 0.0 ? corner.rgb : centre;
        }
    colour_out = vec4(sum / 8.0, 1.0);
}
