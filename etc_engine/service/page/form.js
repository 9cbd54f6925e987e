"use strict";
// The form of a new study, made from the JSON schema of a study: nothing here knows a key by its name.
// `x-with` of a key names the choices with which it has a meaning, `x-words` the words it may be.

const decimal = word => word.trim() !== "" && Number.isFinite(Number(word)) ? Number(word) : word.trim();

// The tables of a schema, each with its fields; keys of the study itself come first, without a table.
function tablesOf(schema) {
  const named = node => node.$ref ? { ...schema.$defs[node.$ref.split("/").pop()], ...node } : node;
  const ways = node => {
    const inner = named(node), several = inner.anyOf || inner.oneOf;
    return several ? several.flatMap(ways) : inner.type === "null" ? [] : [inner];
  };
  const fields = (node, place, required, above = {}) => {
    const found = ways(node), types = found.map(way => way.type), needs = { ...above, ...node["x-with"] };
    const table = found.find(way => way.properties);
    if (table) return Object.entries(table.properties).flatMap(([key, inner]) =>
      fields(inner, `${place}.${key}`, (table.required || []).includes(key), needs));
    if (node.const !== undefined) return [];
    const items = found.filter(way => way.items).map(way => way.items.type);
    return [{ place, title: node.title || place, hint: node.description || "", needs, required,
      words: node["x-words"] || found.map(way => way.enum).find(Boolean) || (types.includes("boolean") ? ["false", "true"] : null),
      truth: types.includes("boolean"), start: node.default ?? null,
      list: types.includes("array"), single: types.some(type => type !== "array"),
      numbers: [...types, ...items].some(type => type === "number" || type === "integer") }];
  };
  const study = [], tables = [];
  for (const [key, node] of Object.entries(schema.properties)) {
    const found = fields(node, key, (schema.required || []).includes(key));
    if (found.length && found[0].place === key) study.push(...found);
    else if (found.length) tables.push([key, found]);
  }
  return [["study", study], ...tables];
}

// What a form holds at first: the example of the schema, and defaults.
function startOf(schema, tables) {
  const example = (schema.examples || [{}])[0];
  const written = value => value === null || value === undefined ? "" : Array.isArray(value) ? value.join(", ") : String(value);
  const values = {};
  for (const { place, start } of tables.flatMap(([, fields]) => fields)) {
    const given = place.split(".").reduce((inner, key) => inner === undefined || inner === null ? undefined : inner[key], example);
    values[place] = written(given === undefined ? start : given);
  }
  return values;
}

function parsed(field, word) {
  const one = piece => field.numbers ? decimal(piece) : field.truth ? piece.trim() === "true" : piece.trim();
  const pieces = word.split(",").filter(piece => piece.trim() !== "");
  return field.list && (pieces.length > 1 || !field.single) ? pieces.map(one) : one(word);
}

// The words of a field; those of some depend on another choice.
function wordsOf(field, values) {
  if (!field.words || Array.isArray(field.words)) return field.words;
  const [[choice, words]] = Object.entries(field.words);
  return words[values[choice]] || [];
}

// Whether a key has a meaning with what is chosen; a choice that is left out is the first of its words.
function meant(field, values, fields) {
  return Object.entries(field.needs).every(([choice, words]) => {
    const asked = fields.find(other => other.place === choice);
    const chosen = values[choice].split(",").map(word => word.trim()).filter(Boolean);
    return (chosen.length ? chosen : (wordsOf(asked, values) || [""]).slice(0, 1)).some(word => words.includes(word));
  });
}

// The study that a filled form describes; what is empty or without a meaning is left out.
function studyOf(schema, tables, values) {
  const study = { schema: schema.properties.schema.const }, all = tables.flatMap(([, fields]) => fields);
  for (const field of all) {
    if (values[field.place].trim() === "" || !meant(field, values, all)) continue;
    if (!field.required && values[field.place] === String(field.start)) continue;
    const keys = field.place.split("."), last = keys.pop();
    keys.reduce((inner, key) => inner[key] = inner[key] || {}, study)[last] = parsed(field, values[field.place]);
  }
  return study;
}

function tomlOf(study) {
  const word = value => typeof value === "string" ? JSON.stringify(value)
    : Array.isArray(value) ? `[${value.map(word).join(", ")}]`
    : value !== null && typeof value === "object" ? `{ ${Object.entries(value).map(([key, item]) => `${key} = ${word(item)}`).join(", ")} }`
    : String(value);
  const lines = [], tables = [];
  for (const [key, value] of Object.entries(study)) {
    if (typeof value === "object" && !Array.isArray(value))
      tables.push("", `[${key}]`, ...Object.entries(value).map(([name, item]) => `${name} = ${word(item)}`));
    else lines.push(`${key} = ${word(value)}`);
  }
  return [...lines, ...tables, ""].join("\n");
}
if (typeof module !== "undefined") module.exports = { tablesOf, startOf, parsed, wordsOf, meant, studyOf, tomlOf };
