// Meshes of a layer with the same material and class become one, which is drawn at once.
import { Group, mergeGeometries } from "./three.js";
import { PartedMesh } from "./parted_mesh.js";

/**
 * Joins the single meshes below a layer; instances and meshes with levels stay.
 */
export function joined(layer, keeps) {
  const groups = new Map();
  for (const node of [...layer.children]) {
    if (node.userData.count !== undefined || keeps(node)) continue;
    let whole = true;
    node.traverse((mesh) => {
      if (!mesh.isMesh) return;
      if (mesh.isInstancedMesh) { whole = false; return; }
      const names = Object.keys(mesh.geometry.attributes).sort().join();
      const label = mesh.geometry.userData.class || "void";
      const key = `${mesh.material.uuid} ${label} ${names} ${mesh.geometry.index.array.constructor.name}`;
      if (!groups.has(key)) groups.set(key, { label, material: mesh.material, parts: [] });
      groups.get(key).parts.push({ geometry: mesh.geometry, facts: node.userData });
    });
    if (whole && node.children.every((child) => child.isMesh)) layer.remove(node);
  }
  const holder = new Group();
  for (const { label, material, parts } of groups.values()) {
    const geometries = parts.map((part) => part.geometry);
    let first = 0;
    const known = parts.map(({ geometry, facts }) => {
      const part = { first, facts, part: geometry.userData.part };
      first += geometry.index.count / 3;
      return part;
    });
    holder.add(new PartedMesh(mergeGeometries(geometries), material, label, known));
    for (const geometry of geometries) geometry.dispose();
  }
  layer.add(holder);
}
