#version 450 core
// Triangles of merged meshes and of instances. World positions are relative to the camera; the
// tiles' origins are subtracted in double precision before the upload.
layout(location = 0) in vec3 position;
layout(location = 1) in vec4 normal;
layout(location = 2) in vec2 uv;
layout(location = 3) in vec4 colour;
layout(location = 4) in uint vertex_object;
layout(location = 5) in vec4 row_x;
layout(location = 6) in vec4 row_y;
layout(location = 7) in vec4 row_z;
layout(location = 8) in uint instance_object;
layout(location = 9) in uint tile;
layout(location = 10) in uint number;

uniform samplerBuffer tile_origins;
uniform mat4 clip;

out vec3 world_position;
out vec3 world_normal;
out vec2 texture_uv;
out vec3 mesh_colour;
flat out uint scene_object;
flat out uint instance_number;
invariant gl_Position;  // the depth pass and the colour pass must agree bit by bit

void main() {
    vec4 point = vec4(position, 1.0);
    vec3 placed = vec3(dot(row_x, point), dot(row_y, point), dot(row_z, point));
    world_position = placed + texelFetch(tile_origins, int(tile)).xyz;
    // The cofactor matrix rotates normals like the inverse transpose.
    vec3 cofactor_x = cross(row_y.xyz, row_z.xyz);
    vec3 cofactor_y = cross(row_z.xyz, row_x.xyz);
    vec3 cofactor_z = cross(row_x.xyz, row_y.xyz);
    vec3 turned = vec3(
        dot(cofactor_x, normal.xyz), dot(cofactor_y, normal.xyz), dot(cofactor_z, normal.xyz));
    world_normal = turned * sign(dot(row_x.xyz, cofactor_x));
    texture_uv = uv;
#if defined(uses_vertex_colour) && uses_vertex_colour == 2
    mesh_colour = colour.a == 0.0 ? vec3(1.0) : colour.rgb;
#else
    mesh_colour = colour.rgb;
#endif
    instance_number = number;
    scene_object = vertex_object + instance_object;
    gl_Position = clip * vec4(world_position, 1.0);
}
