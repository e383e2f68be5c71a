// Meshes of a layer with the same material and class become one, which is drawn at once.
import { Group, Mesh, mergeGeometries } from "./three.js";

/**
 * Joins the single meshes below a layer; instances and meshes with levels stay.
 * The joined mesh knows the first triangle and the facts of each part (`userData.parts`).
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
    const mesh = new Mesh(mergeGeometries(geometries), material);
    let first = 0;
    mesh.userData.parts = parts.map(({ geometry, facts }) => {
      const part = { first, facts, part: geometry.userData.part };
      first += geometry.index.count / 3;
      return part;
    });
    mesh.userData.label = label;
    for (const geometry of geometries) geometry.dispose();
    holder.add(mesh);
  }
  layer.add(holder);
}

/** The part of a joined mesh that holds a triangle. */
export function partAt(parts, triangle) {
  let low = 0, high = parts.length - 1;
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (parts[middle].first <= triangle) low = middle;
    else high = middle - 1;
  }
  return { ...parts[low], end: parts[low + 1]?.first };
}
