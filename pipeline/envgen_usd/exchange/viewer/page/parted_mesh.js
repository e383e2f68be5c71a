// A mesh of many parts, which draws those in sight and knows which part a triangle belongs to.
import { Mesh } from "./three.js";

const CELL = 25; // Side in metres of the squares of ground; a larger one draws more out of sight.
const THICK = [0.05, 0.1, 0.2, 0.4, 0.8, 1.6]; // Thicknesses in metres by which the triangles of a part are sorted.

export class PartedMesh extends Mesh {
  /**
   * @param geometry all parts, one after the other @param material what is drawn @param label class
   * @param parts first triangle, facts and meaning of each part, and perhaps from where it is drawn:
   * a place, the least and the largest distance
   */
  constructor(geometry, material, label, parts) {
    super(geometry, material);
    geometry.computeBoundingSphere();
    this.userData = { label, parts };
    this.all = geometry.index.array.slice();
    this.starts = [...parts.map(({ first }) => 3 * first), this.all.length];
    this.thick = this.sortedByThickness();
    this.shown = null; // Numbers of the parts that are drawn, or null for all.
    this.counts = null; // Corners that are drawn of each of them.
    this.drawn = null; // First triangle of each part that is drawn.
    this.spheres = this.spheresOf();
    this.windows = parts.some(({ window }) => window) &&
      Float32Array.from(parts.flatMap(({ window }) => window || [0, 0, 0, 0, Infinity]));
  }

  /** Middle and radius of each part. */
  spheresOf() {
    const { array, itemSize } = this.geometry.attributes.position;
    const spheres = new Float32Array(4 * this.userData.parts.length);
    for (let part = 0; part < this.userData.parts.length; part++) {
      const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
      for (let i = this.starts[part]; i < this.starts[part + 1]; i++) {
        for (let k = 0; k < 3; k++) {
          const value = array[this.all[i] * itemSize + k];
          if (value < low[k]) low[k] = value;
          if (value > high[k]) high[k] = value;
        }
      }
      let square = 0;
      for (let k = 0; k < 3; k++) {
        spheres[4 * part + k] = (low[k] + high[k]) / 2;
        square += ((high[k] - low[k]) / 2) ** 2;
      }
      spheres[4 * part + 3] = Math.sqrt(square);
    }
    return spheres;
  }

  /**
   * Sorts the triangles of each part, the thickest first.
   * @returns for each part and each of `THICK` the corners of the triangles that are at least as thick
   */
  sortedByThickness() {
    const { all, starts } = this, { array, itemSize } = this.geometry.attributes.position;
    const levels = THICK.length, counts = new Uint32Array(levels * (starts.length - 1));
    for (let part = 0; part + 1 < starts.length; part++) {
      const buckets = Array.from({ length: levels + 1 }, () => []);
      for (let i = starts[part]; i < starts[part + 1]; i += 3) {
        const thickness = thicknessOf(array, itemSize * all[i], itemSize * all[i + 1], itemSize * all[i + 2]);
        let level = levels;
        while (level > 0 && thickness < THICK[level - 1]) level -= 1;
        buckets[level].push(all[i], all[i + 1], all[i + 2]);
      }
      let end = starts[part];
      for (let level = levels; level >= 0; level--) {
        all.set(buckets[level], end);
        end += buckets[level].length;
        if (level) counts[levels * part + level - 1] = end - starts[part];
      }
    }
    this.geometry.index.array.set(all);
    return counts;
  }

  /** Corners of a part that are drawn: without the triangles that are too thin for the sight. */
  countOf(part, { eye, grain }) {
    const s = this.spheres, at = 4 * part, whole = this.starts[part + 1] - this.starts[part];
    const distance = Math.hypot(s[at] - eye.x, s[at + 1] - eye.y, s[at + 2] - eye.z) - s[at + 3];
    let level = THICK.length;
    while (level > 0 && grain * distance < THICK[level - 1]) level -= 1;
    return level ? this.thick[THICK.length * part + level - 1] : whole;
  }

  /** Draws the parts in sight; a mesh that is in sight as a whole, or not at all, stays as it is. */
  choose(sight) {
    const { center, radius } = this.geometry.boundingSphere;
    const place = [center.x, center.y, center.z, radius];
    if (!sight.meets(...place)) return;
    if (!this.windows && !sight.grain && sight.holds(...place)) {
      if (this.shown) this.draw(null);
      return;
    }
    const s = this.spheres, shown = [], counts = [];
    for (let part = 0, at = 0; at < s.length; part++, at += 4) {
      if (!this.isNear(part, sight) || !sight.meets(s[at], s[at + 1], s[at + 2], s[at + 3])) continue;
      const count = this.countOf(part, sight);
      if (count) shown.push(part) && counts.push(count);
    }
    if (counts.reduce((sum, count) => sum + count, 0) === this.all.length) {
      if (this.shown) this.draw(null);
    } else if (!isSame(shown, this.shown) || !isSame(counts, this.counts)) this.draw(shown, counts);
  }

  /** True if a part is drawn at its distance. */
  isNear(part, { eye, reach }) {
    if (!this.windows) return true;
    const w = this.windows, at = 5 * part;
    const distance = Math.hypot(w[at] - eye.x, w[at + 1] - eye.y, w[at + 2] - eye.z);
    return distance >= w[at + 3] && distance < w[at + 4] * reach;
  }

  draw(shown, counts) {
    const { index } = this.geometry, { all, starts } = this;
    this.shown = shown;
    this.counts = counts;
    this.drawn = [];
    let end = 0;
    if (!shown) index.array.set(all);
    for (let k = 0; shown && k < shown.length; k++) {
      const from = starts[shown[k]];
      this.drawn.push(end / 3);
      let to = from + counts[k];
      // Whole parts that follow one another are copied at once.
      while (to === starts[shown[k] + 1] && shown[k + 1] === shown[k] + 1) {
        k += 1;
        this.drawn.push((end + to - from) / 3);
        to += counts[k];
      }
      index.array.set(all.subarray(from, to), end);
      end += to - from;
    }
    const count = shown ? end : this.all.length;
    this.geometry.setDrawRange(0, count);
    index.clearUpdateRanges();
    index.addUpdateRange(0, count);
    index.needsUpdate = count > 0;
    this.visible = count > 0;
  }

  /** The part that a drawn triangle belongs to. */
  partAt(triangle) {
    const firsts = this.shown ? this.drawn : null;
    let low = 0, high = (this.shown || this.userData.parts).length - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if ((firsts ? firsts[middle] : this.userData.parts[middle].first) <= triangle) low = middle;
      else high = middle - 1;
    }
    return this.userData.parts[this.shown ? this.shown[low] : low];
  }

  /** Grows a box by all parts with these facts. */
  expand(box, facts, corner) {
    this.userData.parts.forEach((part, number) => {
      if (part.facts !== facts) return;
      for (let i = this.starts[number]; i < this.starts[number + 1]; i++) {
        box.expandByPoint(corner.fromBufferAttribute(this.geometry.attributes.position, this.all[i]));
      }
    });
  }
}

/** Smallest height of a triangle whose corners begin at three places of an array. */
function thicknessOf(array, a, b, c) {
  const x = array[b] - array[a], y = array[b + 1] - array[a + 1], z = array[b + 2] - array[a + 2];
  const u = array[c] - array[a], v = array[c + 1] - array[a + 1], w = array[c + 2] - array[a + 2];
  const double = Math.hypot(y * w - z * v, z * u - x * w, x * v - y * u);
  const longest = Math.max(Math.hypot(x, y, z), Math.hypot(u, v, w), Math.hypot(u - x, v - y, w - z));
  return longest > 0 ? double / longest : 0;
}

function isSame(some, others) {
  return some.length === others?.length && some.every((each, k) => each === others[k]);
}

/** The triangles of a mesh of ground by squares, which all have the same facts. */
export function inSquares(mesh, facts) {
  const { geometry, material } = mesh, { index, attributes } = geometry;
  const { array, itemSize } = attributes.position, old = index.array, cells = new Map();
  for (let i = 0; i < old.length; i += 3) {
    const at = old[i] * itemSize;
    const key = `${Math.floor(array[at] / CELL)} ${Math.floor(array[at + 2] / CELL)}`;
    if (!cells.has(key)) cells.set(key, []);
    cells.get(key).push(old[i], old[i + 1], old[i + 2]);
  }
  const parts = [], sorted = new old.constructor(old.length);
  let end = 0;
  for (const corners of cells.values()) {
    parts.push({ first: end / 3, facts, part: geometry.userData.part });
    sorted.set(corners, end);
    end += corners.length;
  }
  index.array.set(sorted);
  return new PartedMesh(geometry, material, geometry.userData.class || "void", parts);
}
