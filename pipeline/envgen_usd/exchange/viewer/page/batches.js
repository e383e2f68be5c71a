// Instances of a mesh: detailed near the camera, simpler or left out at a distance.
import { Box3, Matrix4, Vector3 } from "./three.js";

const DETAILED = 50; // Distance in metres within which instances are drawn in detail.
const REACH = 130; // Distance, in radii of the mesh, up to which it is drawn at all.
const SIMPLE = 12; // Triangles of a mesh that is drawn from WIDER times as far, e.g. window panes.
const WIDER = 6;

export class Batch {
  /**
   * @param node its instanced meshes @param far those of the simpler level, or null
   * @param detail factor of the distances; less draws less
   */
  constructor(node, far, detail) {
    this.detail = detail;
    this.near = DETAILED * detail;
    const meshes = (root) => {
      const found = [];
      root?.traverse((object) => object.isInstancedMesh && found.push(object));
      return found;
    };
    this.layer = node.parent;
    this.table = node.userData;
    this.rows = [];
    const near = meshes(node);
    this.levels = [...near, ...meshes(far)].map((mesh) => this.level(mesh, near.includes(mesh), far));
    const all = near[0].instanceMatrix.array.slice();
    const matrix = new Matrix4();
    this.places = Array.from({ length: near[0].count }, (_, number) => {
      matrix.fromArray(all, 16 * number);
      return { scale: matrix.getMaxScaleOnAxis(), matrix: all.subarray(16 * number, 16 * number + 16) };
    });
    this.spheres = this.spheresOf(near);
    for (const { mesh } of this.levels) {
      mesh.computeBoundingSphere(); // Of all instances, whichever are drawn.
      mesh.userData = { ...mesh.userData, order: [], table: node.userData };
    }
    this.hide();
  }

  /** Middle and radius of each instance. */
  spheresOf(meshes) {
    const box = new Box3();
    for (const { geometry } of meshes) box.union(geometry.boundingBox);
    const middle = box.getCenter(new Vector3()), radius = box.getSize(new Vector3()).length() / 2;
    const matrix = new Matrix4(), place = new Vector3();
    return Float32Array.from(this.places.flatMap((each) => {
      place.copy(middle).applyMatrix4(matrix.fromArray(each.matrix));
      return [place.x, place.y, place.z, radius * each.scale];
    }));
  }

  level(mesh, isNear, far) {
    mesh.geometry.computeBoundingBox();
    mesh.geometry.computeBoundingSphere();
    const triangles = mesh.geometry.index.count / 3;
    const reach = mesh.geometry.boundingSphere.radius * REACH * this.detail * (triangles <= SIMPLE ? WIDER / this.detail : 1);
    if (isNear && far) return { mesh, from: 0, to: Math.min(this.near, reach) };
    return { mesh, from: far ? this.near : 0, to: reach };
  }

  /** Facts of an instance; the same object each time, so that parts of an instance are known. */
  facts(row) {
    return (this.rows[row] ??= { table: this.table, row });
  }

  /** Hides all instances, which something else shows; `choose` shows them again. */
  hide() {
    for (const { mesh } of this.levels) mesh.visible = false;
  }

  /** Keeps the near instances in sight; `order` names their rows. Others are joined. */
  choose(sight) {
    const orders = this.levels.map(() => []), { spheres, near } = this, { eye } = sight;
    for (let row = 0, at = 0; at < spheres.length; row++, at += 4) {
      const x = spheres[at], y = spheres[at + 1], z = spheres[at + 2];
      const distance = Math.hypot(x - eye.x, y - eye.y, z - eye.z);
      if (distance >= near || !sight.meets(x, y, z, spheres[at + 3])) continue;
      for (let k = 0; k < orders.length; k++) {
        const { from, to } = this.levels[k];
        if (from === 0 && distance < to * this.places[row].scale) orders[k].push(row);
      }
    }
    this.levels.forEach(({ mesh }, k) => this.draw(mesh, orders[k]));
  }

  draw(mesh, order) {
    mesh.visible = order.length > 0;
    const before = mesh.userData.order;
    if (order.length === before.length && order.every((row, k) => row === before[k])) return;
    order.forEach((row, k) => mesh.instanceMatrix.array.set(this.places[row].matrix, 16 * k));
    mesh.userData.order = order;
    mesh.count = order.length;
    mesh.instanceMatrix.clearUpdateRanges();
    mesh.instanceMatrix.addUpdateRange(0, 16 * order.length);
    mesh.instanceMatrix.needsUpdate = order.length > 0;
  }
}
