// The work of this page, kept in the browser (IndexedDB), so that it survives a reload. Each tab keeps its own; a new
// tab begins with the newest.

import type { FileMap } from "./files";

const DATABASE = "abbe";
/** Values by tab and name; files by tab and path. */
const [VALUES, FILES] = ["values", "files"];
/** Tabs whose work is kept. */
const MOST_TABS = 5;
/** Longest wait for the work of before, ms: a browser may hold its database shut. */
const LONGEST_WAIT = 2000;
const TIME = "time";

function done<T>(request: IDBRequest<T>): Promise<T> {
  return new Promise((resolve, reject) => {
    request.onsuccess = () => resolve(request.result);
    request.onerror = () => reject(request.error);
  });
}

function ended(transaction: IDBTransaction): Promise<void> {
  return new Promise((resolve, reject) => {
    transaction.oncomplete = () => resolve();
    transaction.onabort = transaction.onerror = () => reject(transaction.error);
  });
}

let opened: Promise<IDBDatabase> | undefined;

function database(): Promise<IDBDatabase> {
  opened ??= new Promise((resolve, reject) => {
    const request = indexedDB.open(DATABASE, 1);
    request.onupgradeneeded = () => {
      request.result.createObjectStore(VALUES);
      request.result.createObjectStore(FILES);
    };
    request.onsuccess = () => resolve(request.result);
    request.onerror = () => reject(request.error);
  });
  return opened;
}

const everyKeyOf = (tab: string) => IDBKeyRange.bound([tab], [tab, []]);

/** The number of this tab, which a reload keeps. */
function ownTab(): { tab: string; isNew: boolean } {
  const known = sessionStorage.getItem(DATABASE);
  const tab = known ?? `${Date.now()}-${Math.random().toString(36).slice(2)}`;
  if (!known) sessionStorage.setItem(DATABASE, tab);
  return { tab, isNew: !known };
}

/** The tabs that keep work, newest first. */
async function tabs(values: IDBObjectStore): Promise<string[]> {
  const keys = (await done(values.getAllKeys())) as [string, string][];
  const times = keys.filter(([, name]) => name === TIME);
  const found = await Promise.all(times.map(async (key) => [key[0], (await done(values.get(key))) as number] as const));
  return found.sort((a, b) => b[1] - a[1]).map(([tab]) => tab);
}

/** What was kept: values by name, and files. */
export interface Kept {
  values: Map<string, unknown>;
  files: FileMap;
}

/** Keeps values and files of this tab. A browser that keeps nothing (private windows) makes no fault. */
export class Store {
  private known: FileMap = new Map();
  private last: Promise<unknown> = Promise.resolve();

  private constructor(private tab: string) {}

  /** The store of this tab, with what it keeps from before. */
  static async open(): Promise<{ store: Store; kept?: Kept }> {
    let own = { tab: "", isNew: true };
    try {
      own = ownTab();
      const store = new Store(own.tab);
      const late = new Promise<undefined>((resolve) => setTimeout(resolve, LONGEST_WAIT));
      return { store, kept: await Promise.race([store.read(own.isNew), late]) };
    } catch {
      return { store: new Store(own.tab) };
    }
  }

  private async read(isNew: boolean): Promise<Kept | undefined> {
    const transaction = (await database()).transaction([VALUES, FILES], "readwrite");
    const [values, files] = [transaction.objectStore(VALUES), transaction.objectStore(FILES)];
    const all = await tabs(values);
    for (const old of all.filter((tab) => tab !== this.tab).slice(MOST_TABS)) {
      values.delete(everyKeyOf(old));
      files.delete(everyKeyOf(old));
    }
    const from = isNew ? all[0] : this.tab;
    if (from === undefined) return undefined;
    const read = async <T>(store: IDBObjectStore): Promise<Map<string, T>> => {
      const range = everyKeyOf(from);
      const [keys, found] = await Promise.all([done(store.getAllKeys(range)), done(store.getAll(range))]);
      return new Map(keys.map((key, k) => [(key as [string, string])[1], found[k] as T]));
    };
    const [keptValues, keptFiles] = await Promise.all([read<unknown>(values), read<Uint8Array>(files)]);
    // A new tab has kept nothing of it yet.
    if (!isNew) this.known = new Map(keptFiles);
    return { values: keptValues, files: keptFiles };
  }

  /** Does one change after the other, in the order in which they were wanted. */
  private write(change: (values: IDBObjectStore, files: IDBObjectStore) => void): void {
    const run = async () => {
      try {
        const transaction = (await database()).transaction([VALUES, FILES], "readwrite");
        const values = transaction.objectStore(VALUES);
        change(values, transaction.objectStore(FILES));
        values.put(Date.now(), [this.tab, TIME]);
        await ended(transaction);
      } catch {
        // Perhaps the next time, then with all files.
        this.known = new Map();
      }
    };
    this.last = this.last.then(run);
  }

  /** Keeps a value; `undefined` forgets it. */
  keep(name: string, value: unknown): void {
    this.write((values) => {
      if (value === undefined) values.delete([this.tab, name]);
      else values.put(value, [this.tab, name]);
    });
  }

  /** Keeps these files and no others. Only those that changed are written. */
  keepFiles(files: FileMap): void {
    this.write((_, kept) => {
      for (const [path, bytes] of files) if (this.known.get(path) !== bytes) kept.put(bytes, [this.tab, path]);
      for (const path of this.known.keys()) if (!files.has(path)) kept.delete([this.tab, path]);
      this.known = new Map(files);
    });
  }
}
