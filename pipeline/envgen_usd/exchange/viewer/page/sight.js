// What a camera sees of spheres: a little more than it shows, so that small steps change nothing.
import { Vector3 } from "./three.js";

const MARGIN = 0.12; // Angle in radians by which the sight is wider; less draws less and changes more often.
const STEP = 3; // Metres that the camera moves before its sight is another.

export class Sight {
  /**
   * @param camera a perspective camera with its matrices @param reach factor of the distances of parts
   * @param grain angle in radians below which thin triangles of distant parts are left out
   */
  constructor(camera, reach, grain) {
    this.reach = reach;
    this.grain = grain;
    this.eye = new Vector3().setFromMatrixPosition(camera.matrixWorld);
    const [right, up, back] = [0, 1, 2].map((axis) => new Vector3().setFromMatrixColumn(camera.matrixWorld, axis));
    this.right = right;
    this.back = back;
    this.slope = Math.tan((camera.fov * Math.PI) / 360);
    this.aspect = camera.aspect;
    const across = Math.atan(this.slope * this.aspect) + MARGIN, upright = Math.atan(this.slope) + MARGIN;
    const side = (direction, angle) => direction.clone().multiplyScalar(Math.cos(angle)).addScaledVector(back, -Math.sin(angle));
    this.sides = [side(right, across), side(right.clone().negate(), across),
      side(up, upright), side(up.clone().negate(), upright)];
    this.numbers = this.sides.flatMap((normal) => normal.toArray());
  }

  /** True if another sight is too different from this one. */
  isLeft(other) {
    const turned = Math.min(this.right.dot(other.right), this.back.dot(other.back));
    return this.eye.distanceTo(other.eye) > STEP || turned < Math.cos(0.9 * MARGIN) ||
      this.reach !== other.reach || this.grain !== other.grain || this.slope !== other.slope || this.aspect !== other.aspect;
  }

  /** The same sight in a frame whose origin lies at `offset`. */
  from(offset) {
    return Object.assign(Object.create(Sight.prototype), this, { eye: this.eye.clone().sub(offset) });
  }

  /** True if a sphere may be visible. */
  meets(x, y, z, radius) {
    return this.depth(x, y, z) > -radius - STEP;
  }

  /** True if a sphere lies in sight as a whole. */
  holds(x, y, z, radius) {
    return this.depth(x, y, z) > radius + STEP;
  }

  /** Least distance from the four sides, metres; negative outside. */
  depth(x, y, z) {
    const n = this.numbers, { eye } = this;
    const dx = x - eye.x, dy = y - eye.y, dz = z - eye.z;
    return Math.min(n[0] * dx + n[1] * dy + n[2] * dz, n[3] * dx + n[4] * dy + n[5] * dz,
      n[6] * dx + n[7] * dy + n[8] * dz, n[9] * dx + n[10] * dy + n[11] * dz);
  }
}
