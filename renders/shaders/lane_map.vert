#version 450 core
// Ribbons along the lanes, seen from above.
layout(location = 0) in vec3 place;  // relative to the camera
layout(location = 1) in vec2 lane;  // s and t
layout(location = 2) in vec2 direction;
uniform vec3 corner;  // lower corner of the map relative to the camera, and its side, metres
out vec3 ribbon_lane;  // s, t, height
flat out vec2 ribbon_direction;

void main() {
    ribbon_lane = vec3(lane, place.z);
    ribbon_direction = direction;
    gl_Position = vec4((place.xy - corner.xy) / corner.z * 2.0 - 1.0, 0.5, 1.0);
}
