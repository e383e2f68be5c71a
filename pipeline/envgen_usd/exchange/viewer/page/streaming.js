// Chunks come and go with the distance of the camera.
import { Box3, GLTFLoader, Group, Vector3 } from "./three.js";
import { Batch } from "./batches.js";
import { farGroups } from "./far_chunks.js";
import { flattened } from "./flat_meshes.js";
import { joined } from "./joined_meshes.js";
import { PartedMesh, inSquares } from "./parted_mesh.js";
import { Sight } from "./sight.js";

const AT_ONCE = 2; // Files that are loaded at a time; more delay the nearest one.
const KEPT = 1.25; // Share of the range beyond which a chunk goes; 1 makes the border flicker.
const RINGS = [0, 120, 220, 450]; // Distances in metres from which the instances of a chunk are joined anew.
const HOLD = 10; // Metres by which a chunk has to come nearer before it leaves a ring.
const FLAT = 1; // Ring from which mean colours replace textures where no graphics card draws.
const DETAILED = 60; // Distance in metres within which a chunk's ground is drawn in detail.

/** Textures and materials have the same name in all chunks, and are loaded once. */
class SharedLooks {
  constructor(parser, known) {
    this.name = "shared_looks";
    this.parser = parser;
    this.known = known;
  }

  once(key, load) {
    if (!this.known.has(key)) this.known.set(key, load());
    return this.known.get(key);
  }

  loadTexture(index) {
    const { json } = this.parser;
    const texture = json.textures[index];
    const key = `texture ${json.images[texture.source].uri} ${JSON.stringify(json.samplers[texture.sampler])}`;
    return this.once(key, () =>
      this.parser.loadTextureImage(index, texture.source, this.parser.textureLoader));
  }

  loadMaterial(index) {
    const key = `material ${this.parser.json.materials[index].name}`;
    return this.once(key, () => this.parser.loadMaterial(index));
  }
}

/** A node of ground with its meshes in squares. */
function squared(node) {
  const group = new Group(), meshes = [];
  node.traverse((mesh) => mesh.isMesh && meshes.push(mesh));
  group.userData = node.userData;
  group.add(...meshes.map((mesh) => inSquares(mesh, node.userData)));
  node.parent.add(group);
  node.removeFromParent();
  return group;
}

export class Tiles {
  /**
   * @param index content of tiles.json @param url its folder @param changed called after changes
   * @param look gives the material that is drawn for a loaded one
   * @param detail factor of the distances of detail; less draws less
   * @param flat true draws distant chunks with mean colours in place of textures
   */
  constructor(index, url, changed, look, detail, flat) {
    this.group = new Group();
    this.changed = changed;
    this.look = look;
    this.detail = detail;
    this.flat = flat;
    this.rings = RINGS.map((distance) => distance * detail);
    this.url = url;
    this.range = 900;
    this.loading = 0;
    this.failed = [];
    const known = new Map();
    this.loader = new GLTFLoader().register((parser) => new SharedLooks(parser, known));
    const base = index.chunks[0] ? index.chunks[0].offset : [0, 0, 0];
    this.base = new Vector3(...base);
    this.sight = null;
    this.tiles = index.chunks.map((entry) => {
      const offset = new Vector3(...entry.offset).sub(this.base);
      const box = new Box3(new Vector3(...entry.low), new Vector3(...entry.high));
      return { entry, offset, box: box.translate(offset), scene: null, pending: false, distance: 0 };
    });
  }

  get bounds() {
    return this.tiles.reduce((all, tile) => all.union(tile.box), new Box3());
  }

  get loaded() {
    return this.tiles.filter((tile) => tile.scene);
  }

  get isReady() {
    return this.loading === 0 && !this.tiles.some((tile) => this.isWanted(tile));
  }

  isWanted(tile) {
    return !tile.scene && !tile.pending && !tile.failed && tile.distance <= this.range;
  }

  /** Loads what is near, drops what is far, and joins what is distant. */
  update(eye) {
    for (const tile of this.tiles) {
      tile.distance = tile.box.distanceToPoint(eye);
      if (tile.scene && tile.distance > this.range * KEPT) this.drop(tile);
      if (tile.scene) this.choose(tile);
    }
    this.joinFar();
    const wanted = this.tiles.filter((tile) => this.isWanted(tile));
    wanted.sort((a, b) => a.distance - b.distance);
    for (const tile of wanted.slice(0, Math.max(AT_ONCE - this.loading, 0))) this.load(tile);
  }

  /** Leaves out what a camera does not see; a smaller reach and a larger grain leave out more. */
  see(camera, reach = 1, grain = 0) {
    const sight = new Sight(camera, reach, grain);
    if (this.sight && !this.sight.isLeft(sight)) return;
    this.sight = sight;
    for (const tile of this.loaded) this.chooseVisible(tile);
  }

  async load(tile) {
    tile.pending = true;
    this.loading += 1;
    try {
      const gltf = await this.loader.loadAsync(`${this.url}/${tile.entry.file}`);
      await this.prepare(tile, gltf);
      this.choose(tile);
      this.chooseVisible(tile);
      this.group.add(gltf.scene);
      this.joinFar();
    } catch (error) {
      tile.failed = true;
      this.failed.push(`${tile.entry.file}: ${error.message}`);
    }
    tile.pending = false;
    this.loading -= 1;
    this.changed(tile);
  }

  drop(tile) {
    this.unflatten(tile);
    tile.scene.traverse((object) => {
      if (object.geometry) object.geometry.dispose();
      if (object.isInstancedMesh) object.dispose();
    });
    this.group.remove(tile.scene);
    tile.scene = null;
    this.changed(null);
  }

  /** Joins the instances of a chunk that changed its ring; a chunk at a time keeps frames short. */
  joinFar() {
    const ringOf = (tile) => {
      const held = tile.distance + HOLD;
      return this.rings.findLastIndex((start, ring) => (ring <= (tile.ring ?? 0) ? held : tile.distance) >= start);
    };
    const tile = this.loaded.filter((each) => ringOf(each) !== each.ring).sort((a, b) => a.distance - b.distance)[0];
    if (!tile) return;
    this.unflatten(tile);
    for (const group of tile.far) {
      group.traverse((object) => object.isMesh && object.geometry.dispose());
      group.removeFromParent();
    }
    tile.ring = ringOf(tile);
    const groups = farGroups(tile.batches, this.rings[tile.ring]);
    for (const [layer, group] of groups) layer.add(group);
    tile.far = [...groups.values()];
    if (tile.ring) for (const batch of tile.batches) batch.hide();
    this.choose(tile);
    if (this.flat) {
      // Walls and roads near by keep their textures.
      const roots = tile.ring >= FLAT ? tile.scene.children[0].children : tile.far;
      tile.flat = roots.map(flattened).filter(Boolean);
    }
    this.noteParted(tile);
    this.chooseVisible(tile);
    this.changed(tile);
  }

  /** Places a chunk, joins its meshes, and takes the simpler ones that nodes name (MSFT_lod). */
  async prepare(tile, gltf) {
    const { scene, parser } = gltf;
    const nodes = [];
    scene.traverse((node) => nodes.push(node));
    Object.assign(tile, { batches: [], levels: [], far: [], flat: [], ring: null });
    const simpler = new Map();
    for (const node of nodes) {
      const id = node.userData.gltfExtensions?.MSFT_lod?.ids[0];
      if (id !== undefined) simpler.set(node, await parser.getDependency("node", id));
      if (id !== undefined) node.parent.add(simpler.get(node));
    }
    this.dress(scene);
    for (const node of nodes) {
      const far = simpler.get(node) || null;
      if (node.userData.count !== undefined) tile.batches.push(new Batch(node, far, this.detail));
      else if (far) tile.levels.push([node, far]);
    }
    tile.levels = tile.levels.map(([node, far]) => {
      far.userData = { ...node.userData, ...far.userData };
      return [squared(node), far];
    });
    for (const layer of [...scene.children[0].children]) {
      joined(layer, (node) => tile.levels.some((pair) => pair.includes(node)));
    }
    this.dress(scene);
    scene.position.copy(tile.offset);
    scene.updateMatrixWorld(true);
    tile.scene = scene;
    tile.near = null;
    this.noteParted(tile);
  }

  /** Notes the material and the class of each mesh that has none. */
  dress(scene) {
    scene.traverse((object) => {
      if (!object.isMesh || object.userData.ownMaterial) return;
      object.material = object.userData.ownMaterial = this.look(object.material);
      object.userData.label ??= object.geometry.userData.class || "void";
    });
  }

  choose(tile) {
    const near = tile.distance < DETAILED * this.detail;
    if (tile.near === near) return;
    tile.near = near;
    for (const [detailed, far] of tile.levels) {
      detailed.visible = near;
      far.visible = !near;
    }
  }

  /** Shows the materials of a chunk again. */
  unflatten(tile) {
    for (const { group, taken } of tile.flat) {
      for (const mesh of group.children) mesh.geometry.dispose();
      group.removeFromParent();
      for (const [mesh, parent] of taken) parent.add(mesh);
    }
    tile.flat = [];
  }

  /** Lists the meshes of many parts. */
  noteParted(tile) {
    tile.parted = [];
    tile.scene.traverse((object) => object instanceof PartedMesh && tile.parted.push(object));
  }

  /** Leaves out instances and parts that are out of sight. */
  chooseVisible(tile) {
    if (!this.sight || tile.ring === null) return;
    const sight = this.sight.from(tile.offset);
    if (!tile.ring) for (const batch of tile.batches) batch.choose(sight);
    for (const mesh of tile.parted) mesh.choose(sight);
  }
}
