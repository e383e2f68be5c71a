#version 450 core
// One triangle over the whole image, at infinite depth.
uniform vec4 lens;  // fx, fy, cx, cy in pixels
uniform vec2 image_size;
uniform mat3 camera_axes;  // from the camera's space to the world
out vec3 ray;

void main() {
    vec2 corner = vec2((gl_VertexID & 1) * 4 - 1, (gl_VertexID & 2) * 2 - 1);
    vec2 pixel = (corner * vec2(0.5, -0.5) + 0.5) * image_size - 0.5;
    ray = camera_axes * vec3((pixel - lens.zw) / lens.xy, 1.0);
    gl_Position = vec4(corner, 0.0, 1.0);
}
