#version 450 core
// Marks the pixels of each object in a mask of its own, whatever hides it.
#include "cut.glsl"
in vec2 texture_uv;
flat in uint scene_object;
layout(std430, binding = 0) readonly buffer Slots { uint slots[]; };  // by scene object, from 1
layout(std430, binding = 1) buffer Masks { uint masks[]; };  // a bit for each pixel
uniform int image_width;
uniform int mask_words;

void main() {
    cut_out(texture_uv);
    uint slot = slots[scene_object];
    if (slot == 0u) discard;
    uint pixel = uint(gl_FragCoord.y) * uint(image_width) + uint(gl_FragCoord.x);
    atomicOr(masks[(slot - 1u) * uint(mask_words) + pixel / 32u], 1u << (pixel % 32u));
}
