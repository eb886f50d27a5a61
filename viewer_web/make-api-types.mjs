/**
 * Makes types of the schemas that pydantic models give: src/api/schema.ts of src/api/openapi.json, which
 * `python -m viewer_web.server.openapi` writes, and src/load/plan-types.ts of docs/formats/plan.schema.json, which comes
 * along as src/load/plan-schema.json for checking what is loaded: `npm run types`.
 */
import { execFileSync } from 'node:child_process';
import { readFileSync, writeFileSync } from 'node:fs';
import { fileURLToPath } from 'node:url';
import { compile } from 'json-schema-to-typescript';

const PLAN_SCHEMA = new URL('../docs/formats/plan.schema.json', import.meta.url);

/** What each generated file holds, by its path, not yet formatted. */
export async function generated() {
  return {
    'src/api/schema.ts': await apiTypes(),
    'src/load/plan-types.ts': await planTypes(),
    'src/load/plan-schema.json': JSON.stringify(withoutWords(read(PLAN_SCHEMA))),
  };
}

async function apiTypes() {
  const { components } = read(new URL('src/api/openapi.json', import.meta.url));
  const head = 'The documents of docs/viewer-api.md. Generated of openapi.json';
  const definitions = referring(components.schemas, '#/components/schemas/');
  // What is as in plan.json has its type from there.
  for (const name of Object.keys(planDefinitions()))
    if (name in definitions) definitions[name] = { tsType: `plan.${name}` };
  const text = await types(definitions, `${head} by \`npm run types\`: change the models in server/`);
  return text.replace(/\*\/\n/, "*/\nimport type * as plan from '../load/plan-types.ts';\n");
}

async function planTypes() {
  const head = 'plan.json. Generated of docs/formats/plan.schema.json';
  return types(planDefinitions(), `${head} by \`npm run types\`: change its model`);
}

/** Of plans that were checked or are sent: they have all keys with a default. */
function planDefinitions() {
  const { $defs, $schema, $id, ...plan } = read(PLAN_SCHEMA);
  const definitions = referring({ ...$defs, PlanDocument: plan }, '#/$defs/');
  for (const schema of Object.values(definitions)) {
    const filled = Object.entries(schema.properties).filter(([, property]) => 'default' in property);
    schema.required = [...new Set([...(schema.required ?? []), ...filled.map(([key]) => key)])];
    for (const [, property] of filled) delete property.default; // beside a reference it would make a type of its own
  }
  return definitions;
}

function referring(schemas, prefix) {
  return JSON.parse(JSON.stringify(schemas).replaceAll(prefix, '#/definitions/'));
}

function read(url) {
  return JSON.parse(readFileSync(url, 'utf8'));
}

function types(definitions, head) {
  for (const schema of Object.values(definitions)) simplify(schema, true);
  const schema = {
    type: 'object',
    additionalProperties: false,
    required: Object.keys(definitions),
    properties: Object.fromEntries(Object.keys(definitions).map((name) => [name, { $ref: `#/definitions/${name}` }])),
    definitions,
  };
  const options = {
    bannerComment: `/** ${head} instead. */\n`,
    format: false,
    additionalProperties: false,
    declareExternallyReferenced: true,
  };
  return compile(schema, 'Documents', options);
}

/**
 * Titles that pydantic makes of field names would become types of their own; only arrays of a fixed length, such as
 * points, have their length in the type.
 */
function simplify(schema, isTop) {
  if (Array.isArray(schema)) for (const part of schema) simplify(part, false);
  else if (schema !== null && typeof schema === 'object') {
    if (!isTop && typeof schema.title === 'string') delete schema.title;
    if (schema.minItems !== schema.maxItems) {
      delete schema.minItems;
      delete schema.maxItems;
    }
    if (schema.prefixItems !== undefined) {
      schema.items = schema.prefixItems;
      delete schema.prefixItems;
    }
    for (const [key, part] of Object.entries(schema)) {
      // A property may itself be called title.
      if (key === 'properties') for (const property of Object.values(part)) simplify(property, false);
      else simplify(part, false);
    }
  }
}

/** What is for people, the viewer does not need; a property may itself be called description. */
function withoutWords(schema, ofProperties = false) {
  if (Array.isArray(schema)) return schema.map((part) => withoutWords(part));
  if (schema === null || typeof schema !== 'object') return schema;
  const words = ofProperties ? [] : ['description', 'examples', '$schema', '$id'];
  return Object.fromEntries(
    Object.entries(schema)
      .filter(([key]) => !words.includes(key))
      .map(([key, part]) => [key, withoutWords(part, !ofProperties && ['properties', '$defs'].includes(key))]),
  );
}

if (process.argv[1] === fileURLToPath(import.meta.url)) {
  const files = await generated();
  for (const [path, text] of Object.entries(files)) writeFileSync(new URL(path, import.meta.url), text);
  execFileSync('npx', ['biome', 'check', '--write', ...Object.keys(files)], {
    stdio: 'inherit',
    cwd: fileURLToPath(new URL('.', import.meta.url)),
  });
}
