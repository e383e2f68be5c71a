// Instances of a mesh: detailed near the camera, simpler or left out at a distance.
import { Matrix4, Vector3 } from "./three.js";

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
      const scale = matrix.getMaxScaleOnAxis();
      return { scale, place: new Vector3().setFromMatrixPosition(matrix), matrix: all.subarray(16 * number, 16 * number + 16) };
    });
    for (const { mesh } of this.levels) {
      mesh.computeBoundingSphere(); // Of all instances, whichever are drawn.
      mesh.userData = { ...mesh.userData, order: [], table: node.userData };
    }
  }

  level(mesh, isNear, far) {
    mesh.geometry.computeBoundingSphere();
    const triangles = mesh.geometry.index.count / 3;
    const near = DETAILED * this.detail;
    const reach = mesh.geometry.boundingSphere.radius * REACH * this.detail * (triangles <= SIMPLE ? WIDER / this.detail : 1);
    if (isNear && far) return { mesh, from: 0, to: Math.min(near, reach) };
    return { mesh, from: far ? near : 0, to: reach };
  }

  /** Facts of an instance; the same object each time, so that parts of an instance are known. */
  facts(row) {
    return (this.rows[row] ??= { table: this.table, row });
  }

  /** Hides all instances, which something else shows; `choose` shows them again. */
  hide() {
    for (const { mesh } of this.levels) mesh.visible = false;
  }

  /** Keeps the instances that are seen from a place of the chunk; `order` names their rows. */
  choose(eye) {
    const distances = this.places.map(({ place }) => place.distanceTo(eye));
    for (const { mesh, from, to } of this.levels) {
      const order = [];
      distances.forEach((distance, number) => {
        if (distance >= from && distance < to * this.places[number].scale) order.push(number);
      });
      if (order.length === mesh.userData.order.length && order.every((each, k) => each === mesh.userData.order[k])) continue;
      order.forEach((number, k) => mesh.instanceMatrix.array.set(this.places[number].matrix, 16 * k));
      mesh.userData.order = order;
      mesh.count = order.length;
      mesh.visible = order.length > 0;
      mesh.instanceMatrix.needsUpdate = true;
    }
    for (const { mesh } of this.levels) mesh.visible = mesh.userData.order.length > 0;
  }
}
