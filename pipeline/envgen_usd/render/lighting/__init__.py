"""Light on the GPU: sky, the sun's shadows, occlusion, lamps, mirrors."""
