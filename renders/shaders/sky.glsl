// The light of sun and sky. `sun_light` and `bounced_light` are irradiance over pi: the radiance of
// a white surface. The sky map holds radiance, with the zenith in its first row (see
// `light/sky_directions.py`).
uniform vec3 sun_direction;
uniform vec3 sun_light;
uniform vec3 bounced_light;
uniform vec3 sky_harmonics[9];
uniform sampler2D sky_map;

// A blur of 1 shows the mean of the sky, 0 every detail.
vec3 sky_radiance(vec3 direction, float blur) {
    float level = blur * log2(float(textureSize(sky_map, 0).y));
    float longitude = atan(direction.x, -direction.y);
    float latitude = asin(clamp(direction.z, -1.0, 1.0));
    vec2 place = vec2(0.5 - longitude / 6.2831853, 0.5 - latitude / 3.1415927);
    return textureLod(sky_map, place, level).rgb;
}

// Irradiance over pi of a surface with this normal by the upper half of the sky.
vec3 skylight(vec3 n) {
    vec3 sum = 0.282095 * sky_harmonics[0]
        + 0.488603 * (sky_harmonics[1] * n.y + sky_harmonics[2] * n.z + sky_harmonics[3] * n.x)
        + 1.092548 * (sky_harmonics[4] * n.x * n.y + sky_harmonics[5] * n.y * n.z
            + sky_harmonics[7] * n.x * n.z)
        + 0.315392 * sky_harmonics[6] * (3.0 * n.z * n.z - 1.0)
        + 0.546274 * sky_harmonics[8] * (n.x * n.x - n.y * n.y);
    return max(sum, vec3(0.0));
}

// Light of the sky, and of sunlit ground and walls, on a surface with this normal that sees a
// share of the sky. The ground before a wall gets less light, too, where the wall sees less sky.
vec3 ambient_light(vec3 normal, float share) {
    float up = 0.5 + 0.5 * normal.z;
    return share * skylight(normal) + (1.0 - share) * 0.5 * up * bounced_light
        + (1.0 - up) * mix(0.3, 1.0, share) * bounced_light;
}
