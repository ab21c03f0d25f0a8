// Files that a user drops or chooses: folders, ZIP files and single files, within limits of size.

import { Unzip, UnzipInflate } from "fflate";
import { crc32, directory } from "./zip";

/** Largest size of one file, and of all together, bytes. The readings are held in memory several times. */
export const LARGEST_FILE = 100 << 20;
export const LARGEST_FOLDER = 200 << 20;
/** Largest text in the editor, bytes. */
const LARGEST_TEXT = 1 << 20;
/** Largest number of files. */
const MOST_FILES = 2000;

/** A file that cannot be used, in words. */
export class FileFault extends Error {}

export type FileMap = Map<string, Uint8Array>;

const mebibytes = (bytes: number) => `${(bytes / (1 << 20)).toFixed(0)} MiB`;

/** Counts files against the limits. */
class Budget {
  private bytes = 0;
  private files = 0;

  take(name: string, bytes: number): void {
    if (bytes > LARGEST_FILE) {
      throw new FileFault(
        `${name}: more than ${mebibytes(LARGEST_FILE)}, the limit of this page; use the command abbe`,
      );
    }
    this.bytes += bytes;
    if (this.bytes > LARGEST_FOLDER) {
      throw new FileFault(
        `more than ${mebibytes(LARGEST_FOLDER)} together, the limit of this page; use the command abbe`,
      );
    }
  }

  next(): void {
    this.files += 1;
    if (this.files > MOST_FILES) throw new FileFault(`more than ${MOST_FILES} files; drop the folder of one session`);
  }
}

/** The path of a file that another names relative to itself. */
export function beside(file: string, named: string): string {
  const parts: string[] = [];
  for (const part of [...file.split("/").slice(0, -1), ...named.split(/[\\/]/)]) {
    if (part === "..") parts.pop();
    else if (part !== "" && part !== ".") parts.push(part);
  }
  return parts.join("/");
}

/** A path without a leading slash, `.` and `..`; undefined if nothing remains. */
function plainPath(path: string): string | undefined {
  const parts = path.split(/[\\/]/).filter((part) => part !== "" && part !== "." && part !== "..");
  return parts.length ? parts.join("/") : undefined;
}

/** The files of a ZIP file. The sizes that it states are not trusted; damage is found by its directory. */
function unpacked(name: string, bytes: Uint8Array, budget: Budget): FileMap {
  const found: FileMap = new Map();
  let fault: unknown;
  let [entries, started, complete] = [0, 0, 0];
  const stated = directory(bytes);
  const unzip = new Unzip((entry) => {
    entries += 1;
    const path = plainPath(entry.name);
    if (fault || !path || entry.name.endsWith("/")) return;
    started += 1;
    const parts: Uint8Array[] = [];
    let size = 0;
    entry.ondata = (error, part, final) => {
      if (fault) return;
      try {
        if (error) throw error;
        size += part.length;
        if (size > LARGEST_FILE) budget.take(`${name}/${path}`, size);
        budget.take(`${name}/${path}`, part.length);
        parts.push(part);
        if (final) {
          const whole = new Uint8Array(size);
          let at = 0;
          for (const one of parts) {
            whole.set(one, at);
            at += one.length;
          }
          if (stated && !stated.get(entry.name)?.includes(crc32(whole))) {
            throw new FileFault(`${name}: ${path} in it is damaged: its checksum differs; pack the folder again`);
          }
          add(found, path, whole);
          complete += 1;
        }
      } catch (error) {
        fault = error;
        entry.terminate();
      }
    };
    try {
      budget.next();
      entry.start();
    } catch (error) {
      fault = error;
    }
  });
  unzip.register(UnzipInflate);
  try {
    // In pieces, so that a file that unpacks without end is noticed early.
    const piece = 1 << 16;
    for (let at = 0; at < bytes.length && !fault; at += piece) {
      unzip.push(bytes.subarray(at, at + piece), at + piece >= bytes.length);
    }
  } catch (error) {
    fault ??= error;
  }
  if (fault instanceof FileFault) throw fault;
  if (fault) throw new FileFault(`${name}: cannot be unpacked: ${fault instanceof Error ? fault.message : fault}`);
  if (entries === 0 || found.size === 0) throw new FileFault(`${name}: this is no ZIP file, or it is empty`);
  const listed = [...(stated?.values() ?? [])].reduce((sum, sums) => sum + sums.length, 0);
  if (!stated || listed !== entries || complete !== started) {
    throw new FileFault(
      `${name}: this ZIP file is damaged or incomplete: ${complete} of ${started} files are whole, ` +
        `${stated ? `its directory lists ${listed} of ${entries} entries` : "it has no directory"}; pack the folder again`,
    );
  }
  return found;
}

/** Adds a file. Two files under one path would make one session of two. */
function add(found: FileMap, path: string, contents: Uint8Array): void {
  if (found.has(path)) {
    throw new FileFault(`two of these files have the path ${path}; drop the folder of one session`);
  }
  found.set(path, contents);
}

/** Reads files with their paths; ZIP files are unpacked. */
async function readAll(files: { path: string; file: File }[]): Promise<FileMap> {
  if (files.length === 0) throw new FileFault("no file was dropped; drop files, a folder or a ZIP file");
  const budget = new Budget();
  const found: FileMap = new Map();
  for (const { path, file } of files) {
    budget.next();
    budget.take(path, file.size);
    let bytes: Uint8Array;
    try {
      bytes = new Uint8Array(await file.arrayBuffer());
    } catch (error) {
      throw new FileFault(`${path}: cannot be read: ${error instanceof Error ? error.message : error}`);
    }
    if (/\.zip$/i.test(path)) {
      for (const [inner, contents] of unpacked(path, bytes, budget)) add(found, inner, contents);
    } else {
      const plain = plainPath(path);
      if (plain) add(found, plain, bytes);
    }
  }
  return withoutCommonFolder(found);
}

/** Without the folder in which all files lie. */
function withoutCommonFolder(files: FileMap): FileMap {
  const paths = [...files.keys()];
  const first = paths[0]?.split("/")[0];
  const common = paths.length > 1 && paths.every((path) => path.includes("/") && path.split("/")[0] === first);
  if (!common || first === undefined) return files;
  return withoutCommonFolder(new Map([...files].map(([path, bytes]) => [path.slice(first.length + 1), bytes])));
}

/** The files of a folder of a drop, with those in its folders. */
async function ofFolder(folder: FileSystemEntry, into: { path: string; file: File }[]): Promise<void> {
  const reader = (folder as FileSystemDirectoryEntry).createReader();
  for (;;) {
    const some = await new Promise<FileSystemEntry[]>((resolve, reject) => reader.readEntries(resolve, reject));
    if (some.length === 0) return;
    for (const entry of some) {
      if (into.length > MOST_FILES) return;
      if (entry.isDirectory) await ofFolder(entry, into);
      else {
        const file = await new Promise<File>((resolve, reject) => (entry as FileSystemFileEntry).file(resolve, reject));
        into.push({ path: entry.fullPath, file });
      }
    }
  }
}

/** The files of a drop. */
export async function dropped(transfer: DataTransfer): Promise<FileMap> {
  // All at once: after the first wait the drop is empty. A file is taken itself, since in a page from the disk its entry
  // cannot be read.
  const items = [...transfer.items]
    .filter(({ kind }) => kind === "file")
    .map((item) => ({ entry: item.webkitGetAsEntry?.(), file: item.getAsFile() }));
  if (items.length === 0) return chosen(transfer.files);
  const files: { path: string; file: File }[] = [];
  for (const { entry, file } of items) {
    if (entry?.isDirectory) {
      await ofFolder(entry, files).catch(() => {
        throw new FileFault(`${entry.name}: this browser does not read a dropped folder here; press Choose a folder`);
      });
    } else if (file) files.push({ path: file.name, file });
  }
  return readAll(files);
}

/** The files of an input element. */
export async function chosen(list: Iterable<File>): Promise<FileMap> {
  const path = (file: File) => file.webkitRelativePath || file.name;
  return readAll([...list].map((file) => ({ path: path(file), file })));
}

interface Kind {
  session: boolean;
  data: boolean;
  editable: boolean;
}

/** What a file is; by its contents, so that an unchanged file is read once. Each expression stays in its line. */
const kinds = new WeakMap<Uint8Array, Kind>();

function kindOf(contents: Uint8Array): Kind {
  let kind = kinds.get(contents);
  if (!kind) {
    const text = new TextDecoder().decode(contents);
    const session = /^[ \t]*(\[\[[ \t]*test[ \t]*\]\]|test[ \t]*=)/m.test(text);
    // An edited text is written in UTF-8; a file that is not would be damaged.
    const editable = contents.length <= LARGEST_TEXT && !/[\0\ufffd]/.test(text);
    kind = { session, data: session && /^[ \t]*data[ \t]*=/m.test(text), editable };
    kinds.set(contents, kind);
  }
  return kind;
}

/** Bytes that tell whether a file is a table. */
const LOOKED_AT = 1 << 16;

/** Whether a file may be a table of readings: some lines have numbers. The library says whether it is one. */
export function isTable(path: string, contents: Uint8Array): boolean {
  if (!/\.(csv|tsv|txt|dat|asc|prn)$/i.test(path)) return false;
  // Every encoding has digits as these bytes, UTF-16 with zeros between them.
  const text = new TextDecoder("latin1").decode(contents.subarray(0, LOOKED_AT)).replaceAll("\0", "");
  return text.split(/[\r\n]+/).filter((line) => (line.match(/\d+/g)?.length ?? 0) > 1).length > 1;
}

/** Whether the editor takes a file. */
export const isEditable = (contents?: Uint8Array): boolean =>
  contents !== undefined && contents.length <= LARGEST_TEXT && kindOf(contents).editable;

/** The session files: TOML texts with tests. */
export function sessionsIn(files: FileMap): string[] {
  const sessions = [...files]
    .filter(([path]) => path.endsWith(".toml"))
    .map(([path, contents]) => ({ path, ...kindOf(contents) }))
    .filter(({ session }) => session);
  // A session with readings comes before a plan.
  sessions.sort((a, b) => Number(b.data) - Number(a.data) || a.path.localeCompare(b.path));
  return sessions.map(({ path }) => path);
}

export const text = (files: FileMap, path: string): string => new TextDecoder().decode(files.get(path));

/** Saves a file of the page. */
export function download(name: string, contents: BlobPart, type = "application/octet-stream"): void {
  const url = URL.createObjectURL(new Blob([contents], { type }));
  const link = document.createElement("a");
  link.href = url;
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(url), 10_000);
}
