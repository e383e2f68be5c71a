// Facts of what a ray hits: extras of its node, or the row of its instance.

/** @returns facts by name, or null */
export function factsAt({ object, instanceId, faceIndex }) {
  const { parts, table, order, label, ownMaterial } = object.userData;
  const hit = parts && object.partAt(faceIndex);
  const facts = {};
  const node = table ? { table, row: order[instanceId] } : hit ? hit.facts : factsAbove(object);
  if (!node) return null;
  if (node.table) {
    Object.assign(facts, node.table.common || node.table);
    for (const [name, values] of Object.entries(node.table.each || {})) facts[name] = values[node.row];
  } else flatten(node, "", facts);
  const part = hit ? hit.part : object.geometry.userData.part;
  facts.class = hit?.label ?? label;
  if (part) facts.part = part;
  facts.material = (hit?.material ?? ownMaterial).name;
  return facts;
}

function factsAbove(object) {
  let node = object;
  while (node && node.userData.id === undefined) node = node.parent;
  return node && node.userData;
}

const FIELDS = ["id", "kind", "class", "asset", "variants", "size", "part_of", "attributes", "path"];

function flatten(value, prefix, facts) {
  for (const [name, each] of Object.entries(value)) {
    if (!prefix && !FIELDS.includes(name)) continue;
    if (each && typeof each === "object" && !Array.isArray(each)) flatten(each, `${prefix}${name}.`, facts);
    else facts[prefix + name] = each;
  }
}

/** A table of facts. */
export function shown(facts) {
  const table = document.createElement("table");
  const first = ["id", "kind", "class", "part"].filter((name) => name in facts);
  const rest = Object.keys(facts).filter((name) => !first.includes(name));
  for (const name of [...first, ...rest]) {
    const value = facts[name];
    if (value === null || value === undefined || value === "") continue;
    const row = table.insertRow();
    row.insertCell().textContent = name.replace(/^attributes\./, "");
    row.insertCell().textContent = Array.isArray(value) ? value.join(", ") : value;
  }
  return table;
}
