/** What the sources say: the messages they ask the catalogue for, and the texts that bypass it. */
import { readdirSync, readFileSync } from 'node:fs';
import { join, posix } from 'node:path';
import { parseAst } from 'vite';

interface Node {
  readonly type: string;
  readonly [key: string]: unknown;
}

export interface SourceTexts {
  readonly file: string;
  /** First arguments of `t`. */
  readonly messages: readonly string[];
  /** Texts for people that are not asked of the catalogue. */
  readonly literals: readonly string[];
  /** Sources that are loaded before this one. */
  readonly imports: readonly string[];
}

/** Attributes that people read or hear, of elements and of our components. */
const READ = /^(aria-label|aria-valuetext|alt|aside|hint|label|name|placeholder|subtitle|title)$/;
/** Attributes that hold no words. */
const NOT_READ = /^(class|d|href|id|key|kind|points|rel|role|style|target|transform|type|viewBox|data-.*)$/;
/** Words, and not a name, a path, a file, a colour or a selector. */
const PROSE = /[A-Za-z’'”)]{2,}[,:;.!?]? [A-Za-z“({]|^[A-Z][a-z]+( |$)/;
const NO_PROSE = /[\n#]|^(\.|\/|--|\(prefers|select,|button,|meta|"Inter|[a-z-]+ [a-z]+-[a-z-]+$)|px |^\d|^translate\(/;

/** All sources of the viewer, without tests. */
export function sourceTexts(root: string): SourceTexts[] {
  return readdirSync(root, { recursive: true, encoding: 'utf8' })
    .filter(
      (file) => /\.tsx?$/.test(file) && !/\.test\.ts$|^testing|^language\/german/.test(file.replaceAll('\\', '/')),
    )
    .map((file) => textsOf(file.replaceAll('\\', '/'), readFileSync(join(root, file), 'utf8')));
}

/** Of one source. */
export function textsOf(file: string, source: string): SourceTexts {
  const messages: string[] = [];
  const literals: string[] = [];
  const ast = parseAst(source, { lang: file.endsWith('x') ? 'tsx' : 'ts' }) as unknown as Node;
  /** `isRead`: whatever letters are in it, people see them. */
  const visit = (node: unknown, parent: Node | null, isRead: boolean): void => {
    if (Array.isArray(node)) for (const each of node) visit(each, parent, isRead);
    if (typeof node !== 'object' || node === null || !('type' in node)) return;
    const { type, ...parts } = node as Node;
    if (/^(Import|ExportAll|TS|JSXClosing)/.test(type) && !/^TS(As|Satisfies|NonNull)/.test(type)) return;
    if (type === 'CallExpression') {
      const [first, ...rest] = parts.arguments as Node[];
      if ((parts.callee as Node).name === 't' && first?.type === 'Literal') {
        messages.push(first.value as string);
        visit(rest, null, false);
        return;
      }
    }
    if (type === 'BinaryExpression' && /^[!=]==?$/.test(parts.operator as string)) return;
    if (type === 'Property') {
      visit(parts.value, node as Node, isRead);
      return;
    }
    if (type === 'JSXAttribute') {
      const name = String((parts.name as Node).name);
      if (!NOT_READ.test(name)) visit(parts.value, node as Node, READ.test(name));
      return;
    }
    const text = textOf(node as Node);
    if (text !== null && isForPeople(text, type, isRead)) literals.push(text.trim());
    const inside = type === 'JSXElement' || type === 'JSXFragment';
    for (const [key, part] of Object.entries(parts)) {
      visit(part, node as Node, inside ? key === 'children' : isRead && PASSES.test(type));
    }
  };
  visit(ast, null, false);
  const imports = (ast.body as Node[]).filter(isLoaded).map(({ source: from }) => String((from as Node).value));
  const here = imports.filter((path) => path.startsWith('.')).map((path) => posix.join(posix.dirname(file), path));
  return { file, messages, literals, imports: here };
}

/** An import of more than types. */
function isLoaded({ type, importKind, specifiers }: Node): boolean {
  if (type !== 'ImportDeclaration' || importKind === 'type') return false;
  const names = specifiers as Node[];
  return names.length === 0 || names.some((name) => name.importKind !== 'type');
}

/** A source with all that it loads; not what it fetches later. */
export function loadedWith(file: string, sources: readonly SourceTexts[]): SourceTexts[] {
  const found = new Set<SourceTexts>();
  const add = (name: string): void => {
    const source = sources.find((one) => one.file === name);
    if (source === undefined || found.has(source)) return;
    found.add(source);
    source.imports.forEach(add);
  };
  add(file);
  return [...found];
}

/** What stands in these is seen where they are. */
const PASSES =
  /^(JSXExpressionContainer|ConditionalExpression|LogicalExpression|TemplateLiteral|BinaryExpression|ParenthesizedExpression)$/;

function textOf({ type, value, quasis }: Node): string | null {
  if (type === 'JSXText' || (type === 'Literal' && typeof value === 'string')) return value as string;
  if (type !== 'TemplateLiteral') return null;
  return (quasis as { value: { cooked: string } }[]).map((part) => part.value.cooked).join('{}');
}

/** Letters that are seen are a text; elsewhere, prose is one. One letter alone is a key or an axis, mm and ft are units. */
function isForPeople(text: string, type: string, isRead: boolean): boolean {
  const words = text.replaceAll('{}', ' ').trim();
  if (/^(tlsplan|3D|\w|mm|ft|sq ft|m²|%|±|[×☰↶↷‹›!✓·−+]*)$/.test(words)) return false;
  if (type === 'JSXText' || isRead) return /[A-Za-z]{2}/.test(words) && !/^\.|-\w+$|^icon\.svg$/.test(words);
  return PROSE.test(words) && !NO_PROSE.test(words);
}
