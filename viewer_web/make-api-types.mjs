/** Makes src/api/schema.ts of src/api/openapi.json, which `python -m viewer_web.server.openapi` writes: `npm run types`. */
import { execFileSync } from 'node:child_process';
import { readFileSync, writeFileSync } from 'node:fs';
import { fileURLToPath } from 'node:url';
import { compile } from 'json-schema-to-typescript';

const DOCUMENT = new URL('src/api/openapi.json', import.meta.url);
const TYPES = new URL('src/api/schema.ts', import.meta.url);
const HEAD =
  '/** The documents of docs/viewer-api.md. Generated of openapi.json by `npm run types`: change the models in server/ instead. */\n';

/** The types as text, not yet formatted. */
export async function apiTypes() {
  const { components } = JSON.parse(readFileSync(DOCUMENT, 'utf8'));
  const definitions = JSON.parse(
    JSON.stringify(components.schemas).replaceAll('#/components/schemas/', '#/definitions/'),
  );
  for (const schema of Object.values(definitions)) simplify(schema, true);
  const schema = {
    type: 'object',
    additionalProperties: false,
    required: Object.keys(definitions),
    properties: Object.fromEntries(Object.keys(definitions).map((name) => [name, { $ref: `#/definitions/${name}` }])),
    definitions,
  };
  const options = {
    bannerComment: HEAD,
    format: false,
    additionalProperties: false,
    declareExternallyReferenced: true,
  };
  return compile(schema, 'Documents', options);
}

/**
 * Titles that pydantic makes of field names would become types of their own; and only arrays of a fixed length, such as
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
    for (const [key, part] of Object.entries(schema)) {
      // A property may itself be called title.
      if (key === 'properties') for (const property of Object.values(part)) simplify(property, false);
      else simplify(part, false);
    }
  }
}

if (process.argv[1] === fileURLToPath(import.meta.url)) {
  writeFileSync(TYPES, await apiTypes());
  execFileSync('npx', ['biome', 'check', '--write', fileURLToPath(TYPES)], { stdio: 'inherit' });
}
