// What the page of `envgen-usd view` uses of three.js; tools/bundle_three.sh makes one file of it.
export {
  ACESFilmicToneMapping,
  BackSide,
  Box3,
  Box3Helper,
  BufferAttribute,
  BufferGeometry,
  Color,
  DirectionalLight,
  Fog,
  Group,
  HemisphereLight,
  Matrix3,
  Matrix4,
  Mesh,
  MeshBasicMaterial,
  MeshLambertMaterial,
  PMREMGenerator,
  PerspectiveCamera,
  Raycaster,
  Scene,
  ShaderMaterial,
  SphereGeometry,
  Vector2,
  Vector3,
  WebGLRenderer,
} from "three";
export { GLTFLoader } from "three/examples/jsm/loaders/GLTFLoader.js";
export { MapControls } from "three/examples/jsm/controls/MapControls.js";
export { mergeGeometries } from "three/examples/jsm/utils/BufferGeometryUtils.js";
