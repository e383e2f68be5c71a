#version 450 core
// The normal of a triangle from its corners, towards the camera. Derivatives of what the rasteriser
// interpolates would be those of corners that were rounded to parts of a pixel.
layout(triangles) in;
layout(triangle_strip, max_vertices = 3) out;
in vec3 world_position[];
uniform mat3 camera_axes;
flat out vec3 face_normal;

void main() {
    vec3 across = cross(world_position[1] - world_position[0], world_position[2] - world_position[0]);
    vec3 towards = dot(across, world_position[0]) > 0.0 ? -across : across;
    for (int corner = 0; corner < 3; ++corner) {
        face_normal = transpose(camera_axes) * normalize(towards);
        gl_Position = gl_in[corner].gl_Position;
        EmitVertex();
    }
    EndPrimitive();
}
