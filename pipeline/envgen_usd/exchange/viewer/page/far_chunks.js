// Instances beyond the near ones as a few meshes, one for each material and class.
import { BufferAttribute, BufferGeometry, Group, Matrix3, Matrix4, Vector3 } from "./three.js";
import { PartedMesh } from "./parted_mesh.js";

/**
 * Joins what the batches of a chunk show at a distance or beyond, or beyond the near instances.
 * Each part knows from where it is drawn: its `window` is a place, and the least and the largest distance.
 * @param batches batches of a chunk @param distance metres from the camera to the chunk
 * @returns a group for each layer, by the layer's node
 */
export function farGroups(batches, distance) {
  const layers = new Map();
  for (const batch of batches) {
    for (const { mesh, from, to } of batch.levels) {
      const rows = batch.places.flatMap(({ scale }, row) =>
        to * scale > Math.max(distance, from, batch.near) ? [row] : []);
      if (!rows.length) continue;
      const label = mesh.userData.label;
      const names = Object.keys(mesh.geometry.attributes).sort().join();
      const key = `${mesh.userData.ownMaterial.uuid} ${label} ${names}`;
      if (!layers.has(batch.layer)) layers.set(batch.layer, new Map());
      const groups = layers.get(batch.layer);
      if (!groups.has(key)) groups.set(key, { label, material: mesh.userData.ownMaterial, uses: [] });
      groups.get(key).uses.push({ mesh, batch, rows, from: Math.max(from, batch.near), to });
    }
  }
  const found = new Map();
  for (const [layer, groups] of layers) {
    const group = new Group();
    for (const { label, material, uses } of groups.values()) {
      const { geometry, parts } = placed(uses);
      const mesh = new PartedMesh(geometry, material, label, parts);
      mesh.userData.ownMaterial = material;
      group.add(mesh);
    }
    found.set(layer, group);
  }
  return found;
}

/** The geometry of all instances, and the first triangle and facts of each. */
function placed(uses) {
  const first = uses[0].mesh.geometry.attributes;
  const total = (count) => uses.reduce((sum, { mesh, rows }) => sum + count(mesh.geometry) * rows.length, 0);
  const points = total((geometry) => geometry.attributes.position.count);
  const index = new Uint32Array(total((geometry) => geometry.index.count));
  const arrays = Object.fromEntries(Object.entries(first).map(([name, { itemSize }]) =>
    [name, new Float32Array(points * itemSize)]));
  const parts = [], matrix = new Matrix4(), turn = new Matrix3(), vector = new Vector3();
  let start = 0, corner = 0;
  for (const { mesh, batch, rows, from, to } of uses) {
    const { index: corners, attributes } = mesh.geometry;
    for (const row of rows) {
      const place = batch.places[row];
      matrix.fromArray(place.matrix);
      turn.getNormalMatrix(matrix);
      for (const [name, attribute] of Object.entries(attributes)) {
        const { itemSize, count } = attribute;
        for (let i = 0; i < count; i++) {
          const at = (start + i) * itemSize;
          if (itemSize === 3 && name !== "color") {
            vector.fromBufferAttribute(attribute, i);
            if (name === "position") vector.applyMatrix4(matrix);
            else vector.applyMatrix3(turn).normalize();
            vector.toArray(arrays[name], at);
          } else for (let k = 0; k < itemSize; k++) arrays[name][at + k] = attribute.getComponent(i, k);
        }
      }
      const window = [...batch.spheres.subarray(4 * row, 4 * row + 3), from, to * place.scale];
      parts.push({ first: corner / 3, facts: batch.facts(row), part: mesh.geometry.userData.part, window });
      const mirrored = matrix.determinant() < 0;
      for (let i = 0; i < corners.count; i++) {
        const from = mirrored ? i - (i % 3) + 2 - (i % 3) : i;
        index[corner + i] = start + corners.getX(from);
      }
      start += attributes.position.count;
      corner += corners.count;
    }
  }
  const geometry = new BufferGeometry();
  for (const [name, array] of Object.entries(arrays)) {
    geometry.setAttribute(name, new BufferAttribute(array, first[name].itemSize));
  }
  geometry.setIndex(new BufferAttribute(index, 1));
  return { geometry, parts };
}
