// What covers a pixel in part; see partial_cover.py.
uniform sampler2D openness;  // open shares of all leaves, of slender things, of leaves before them; kind

const int WHOLE = 0, SLENDER = 1, LEAF = 2, LEAF_BEFORE_SLENDER = 3;
const float KINDS = 3.0;  // the largest of them, which is 1 in the texture

// The kind of the nearest surface at the centre of a pixel.
int kind_of(vec4 shares) {
    return int(KINDS * shares.a + 0.5);
}

bool is_leaf(int kind) {
    return kind >= LEAF;
}
