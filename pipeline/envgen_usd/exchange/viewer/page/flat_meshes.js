// What is far off as one mesh a layer: vertices have the mean colours of the textures.
import { BufferAttribute, BufferGeometry, Color, Group, MeshBasicMaterial, MeshLambertMaterial } from "./three.js";
import { PartedMesh } from "./parted_mesh.js";

const SIDE = 8; // Pixels to which a texture is shrunk for its mean.
const DIM = 0.05; // Emission, of a white surface in the sun, below which a surface is no light.
const PIECE = 0.7; // Share of a texture's width below which it is a picture.
const materials = new Map(), means = new Map();

/** True for what a mean colour shows at a distance: no gaps, no glass, no light, no picture. */
function isFlat(mesh) {
  const { alphaTest, transparent, emissive, map } = mesh.userData.ownMaterial;
  if (alphaTest || transparent || Math.max(emissive.r, emissive.g, emissive.b) > DIM) return false;
  return !map || !isPicture(mesh.geometry.attributes.uv);
}

/** True if a mesh shows a piece of its texture, as faces of signs do. */
function isPicture(uv) {
  let low = Infinity, high = -Infinity;
  for (let i = 0; i < uv.count; i++) {
    const u = uv.getX(i);
    if (u < low) low = u;
    if (u > high) high = u;
  }
  return high - low < PIECE;
}

/**
 * Takes the meshes below a group that can be flat out of it.
 * @returns the group that shows them, and what was taken with its parents; null for nothing
 */
export function flattened(root) {
  const sides = new Map(), taken = [];
  const take = (mesh) => {
    if (mesh.isMesh && isFlat(mesh)) {
      const { side } = mesh.userData.ownMaterial;
      if (!sides.has(side)) sides.set(side, []);
      sides.get(side).push(mesh);
      taken.push([mesh, mesh.parent]);
    }
    // Instances and other levels of detail are hidden; a mesh of parts only where none is in sight.
    for (const child of mesh.children) if (!child.isInstancedMesh && (child.visible || child instanceof PartedMesh)) take(child);
  };
  take(root);
  if (!taken.length) return null;
  const group = new Group();
  for (const [side, meshes] of sides) group.add(flatMesh(meshes, side));
  for (const [mesh] of taken) mesh.removeFromParent();
  root.add(group);
  return { group, taken };
}

function flatMesh(meshes, side) {
  const total = (name) => meshes.reduce((sum, { geometry }) => sum + geometry.attributes[name].count, 0);
  const points = total("position");
  const positions = new Float32Array(3 * points), normals = new Float32Array(3 * points);
  const colours = new Uint16Array(3 * points);
  const index = new Uint32Array(meshes.reduce((sum, { geometry }) => sum + geometry.index.count, 0));
  const parts = [], colour = new Color(), own = new Color();
  let start = 0, end = 0;
  for (const mesh of meshes) {
    const { attributes } = mesh.geometry, { ownMaterial, label } = mesh.userData;
    positions.set(attributes.position.array, 3 * start);
    normals.set(attributes.normal.array, 3 * start);
    colour.copy(meanOf(ownMaterial));
    for (let i = 0; i < attributes.position.count; i++) {
      own.copy(colour);
      if (ownMaterial.vertexColors && attributes.color) {
        own.r *= attributes.color.getX(i);
        own.g *= attributes.color.getY(i);
        own.b *= attributes.color.getZ(i);
      }
      const at = 3 * (start + i);
      colours[at] = 65535 * Math.min(own.r, 1);
      colours[at + 1] = 65535 * Math.min(own.g, 1);
      colours[at + 2] = 65535 * Math.min(own.b, 1);
    }
    const corners = mesh.all || mesh.geometry.index.array;
    for (const part of mesh.userData.parts || [wholeOf(mesh)]) {
      parts.push({ ...part, first: part.first + end / 3, label, material: ownMaterial });
    }
    for (let i = 0; i < corners.length; i++) index[end + i] = start + corners[i];
    start += attributes.position.count;
    end += corners.length;
  }
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(positions, 3));
  geometry.setAttribute("normal", new BufferAttribute(normals, 3));
  geometry.setAttribute("color", new BufferAttribute(colours, 3, true));
  geometry.setIndex(new BufferAttribute(index, 1));
  if (!materials.has(side)) materials.set(side, new MeshLambertMaterial({ vertexColors: true, side }));
  const mesh = new PartedMesh(geometry, materials.get(side), "", parts);
  mesh.userData.ownMaterial = materials.get(side);
  mesh.userData.looks = geometry.attributes.color;
  return mesh;
}

/** A mesh without parts as a single one. */
function wholeOf(mesh) {
  let node = mesh;
  while (node && node.userData.id === undefined) node = node.parent;
  return { first: 0, facts: node?.userData, part: mesh.geometry.userData.part };
}

/** The colour of a material, times the mean of its texture; linear. */
function meanOf({ color, map }) {
  if (!map) return color;
  if (!means.has(map.uuid)) {
    const canvas = Object.assign(document.createElement("canvas"), { width: SIDE, height: SIDE });
    const context = canvas.getContext("2d", { willReadFrequently: true });
    context.imageSmoothingQuality = "high";
    context.drawImage(map.image, 0, 0, SIDE, SIDE);
    const { data } = context.getImageData(0, 0, SIDE, SIDE);
    const sum = new Color(0, 0, 0), texel = new Color();
    for (let i = 0; i < data.length; i += 4) {
      sum.add(texel.setRGB(data[i] / 255, data[i + 1] / 255, data[i + 2] / 255, "srgb"));
    }
    means.set(map.uuid, sum.multiplyScalar(1 / SIDE ** 2));
  }
  return means.get(map.uuid).clone().multiply(color);
}

const labelled = new MeshBasicMaterial({ vertexColors: true, toneMapped: false, side: 2, fog: false });

/** Shows the colours of the classes, or those of the materials. */
export function showLabels(mesh, on, colourOf) {
  const { userData, geometry } = mesh;
  if (on && !userData.labels) {
    const colours = new Float32Array(3 * geometry.attributes.position.count);
    userData.parts.forEach(({ label }, part) => {
      const { r, g, b } = colourOf(label);
      for (let i = mesh.starts[part]; i < mesh.starts[part + 1]; i++) colours.set([r, g, b], 3 * mesh.all[i]);
    });
    userData.labels = new BufferAttribute(colours, 3);
  }
  geometry.setAttribute("color", on ? userData.labels : userData.looks);
  mesh.material = on ? labelled : userData.ownMaterial;
}
