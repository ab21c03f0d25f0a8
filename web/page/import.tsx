// Import: a foreign CSV becomes the readings of a test. The wizard writes `[test.format]` and `[test.columns]`; the
// library reads the file with them.

import { useEffect, useRef, useState } from "preact/hooks";
import { ChooseSession } from "./choose-session";
import { Drop } from "./drop";
import { Engine } from "./engine";
import { FaultBox, faultOf } from "./fault";
import { beside, FileFault, type FileMap, sessionsIn, text } from "./files";
import { ENCODINGS, guess, type Layout, type Own, rowsOf, SEPARATORS, written } from "./layout";
import type { Opened } from "./main";
import { NumberField } from "./number-field";
import { Scroll } from "./scroll";
import { begun, Status, type Work } from "./status";
import { type Variant, variants } from "./variants";
import { keptValue, useKeeping, useUnsaved } from "./work";

/** A file of another program. */
interface Foreign {
  name: string;
  bytes: Uint8Array;
}

/** What another view hands over: a session that has the test, a file of readings, or both. */
export interface Importable {
  base?: Opened;
  file?: Foreign;
}

interface Found {
  tests: string[];
  columns: Own[];
}

interface Tried {
  words: string;
  rms_um?: number;
  fault?: string;
}

/** The name, or one like it that no file beside the session has: another test may read that file. */
function freeName(files: FileMap, session: string, name: string): string {
  const [, stem, extension] = /^(.*?)(\.[^.]*)?$/s.exec(name) ?? ["", name];
  let free = name;
  for (let number = 2; files.has(beside(session, free)); number++) free = `${stem}-${number}${extension ?? ""}`;
  return free;
}

/** The session with these readings in place of the data of a test. */
export function imported(
  files: FileMap,
  session: string,
  test: number,
  name: string,
  bytes: Uint8Array,
  layout: Layout,
): FileMap {
  const own = freeName(files, session, name);
  const next = new Map(files).set(beside(session, own), bytes);
  return next.set(session, new TextEncoder().encode(written(text(files, session), test, own, layout)));
}

export function Wizard({ opened, analyse }: { opened?: Importable; analyse: (opened: Opened) => void }) {
  const engine = useRef<Engine | undefined>(undefined);
  engine.current ??= new Engine();
  const keeping = useKeeping();
  const [base, setBase] = useState<Opened | undefined>(() => opened?.base ?? keptValue(keeping, "import base"));
  const [found, setFound] = useState<Found>();
  const [test, setTest] = useState(0);
  const [file, setFile] = useState<Foreign | undefined>(() => opened?.file ?? keptValue(keeping, "import file"));
  const [layout, setLayout] = useState<Layout>();
  const [tried, setTried] = useState<Tried[]>([]);
  const [work, setWork] = useState<Work>();
  const [note, setNote] = useState("");
  const [fault, setFault] = useState<unknown>();
  useUnsaved("Import", work !== undefined);
  useEffect(() => keeping.store.keep("import base", base), [base]);
  useEffect(() => keeping.store.keep("import file", file), [file]);
  useEffect(() => {
    if (layout) keeping.store.keep("import layout", { test, layout });
  }, [test, layout]);
  /** What was set before a reload, until it is shown. */
  const kept = useRef(keptValue<{ test: number; layout: Layout }>(keeping, "import layout"));
  useEffect(() => {
    if (!opened) return;
    if (opened.base) setBase(opened.base);
    if (opened.file) take(opened.file);
    else setFile(undefined);
  }, [opened]);
  /** Number of what is imported into what: what was begun for another is not told. */
  const trying = useRef(0);
  const forget = () => {
    trying.current += 1;
    engine.current?.stop();
    setTried([]);
    setWork(undefined);
    setNote("");
    return trying.current;
  };
  useEffect(() => {
    if (!base) return;
    const number = forget();
    setFound(undefined);
    setTest(0);
    setFault(undefined);
    const read = engine.current?.call<Found>("columns", [base.session], { files: base.files });
    read?.then(
      (known) => number === trying.current && setFound(known),
      (error) => number === trying.current && setFault(error),
    );
  }, [base]);
  // A file may come before the session whose columns it has.
  useEffect(() => {
    if (file && found && kept.current) {
      setLayout(kept.current.layout);
      setTest(kept.current.test);
      kept.current = undefined;
      return;
    }
    setLayout(file && found ? guess(file.bytes, found.columns) : undefined);
  }, [file, found]);

  const take = (next: Foreign) => {
    if (/^PK\x03\x04|^\xd0\xcf\x11\xe0/.test(String.fromCharCode(...next.bytes.subarray(0, 4)))) {
      setFault(
        new FileFault(`${next.name}: this is a spreadsheet; name it as \`data\` of the test, or save it as CSV`),
      );
      return;
    }
    // Before the columns of the session are read, nothing was begun with another file.
    if (found) forget();
    kept.current = undefined;
    setFile(next);
    setFault(undefined);
  };
  /** Takes the session that has the test, or the file of readings. */
  const receive = (files: FileMap) => {
    const [session] = sessionsIn(files);
    const [first] = files;
    if (session !== undefined) {
      kept.current = undefined;
      setBase({ files, session });
    } else if (first) take({ name: first[0].split("/").pop() ?? "readings.csv", bytes: first[1] });
  };
  const set = (next: Partial<Layout>) => {
    if (!layout || !file || !found) return;
    // Another separator makes other columns, which are guessed again.
    const columnsChange = "separator" in next || "header" in next || "skip" in next || "encoding" in next;
    const changed = { ...layout, ...next };
    setLayout(columnsChange ? guess(file.bytes, found.columns, changed) : changed);
    forget();
  };
  const rms = async (of: Layout): Promise<number> => {
    if (!base || !file || !engine.current) return Number.NaN;
    const files = imported(base.files, base.session, test, file.name, file.bytes, of);
    const { json } = await engine.current.call<{ json: string }>("fit", [base.session], { files });
    return JSON.parse(json).rms_um as number;
  };
  const tryAll = async () => {
    if (!layout || !found) return;
    const number = forget();
    const results: Tried[] = [];
    const all: Variant[] = [{ words: "as guessed", layout }, ...variants(layout, found.columns)];
    const { since } = begun("");
    for (const [k, variant] of all.entries()) {
      setWork({ words: `fit ${k + 1} of ${all.length}: ${variant.words}`, since });
      try {
        results.push({ words: variant.words, rms_um: await rms(variant.layout) });
      } catch (error) {
        const { message, line } = faultOf(error);
        results.push({ words: variant.words, fault: line ? `line ${line}: ${message}` : message });
      }
      if (number !== trying.current) return;
      setTried([...results]);
    }
    setWork(undefined);
  };
  /** What was fitted until then stays. */
  const stop = () => {
    trying.current += 1;
    engine.current?.stop();
    setWork(undefined);
    setNote("stopped");
  };
  const use = () => {
    if (!base || !file || !layout) return;
    const files = imported(base.files, base.session, test, file.name, file.bytes, layout);
    analyse({ files, session: base.session, base: base.files });
    // The next file goes into the same session.
    kept.current = undefined;
    setBase({ files, session: base.session });
    setFile(undefined);
  };
  const rows = file && layout ? rowsOf(file.bytes, layout).slice(0, 8) : [];
  return (
    <>
      <p>
        Readings of another program become those of a test.{" "}
        {base ? `They go into ${base.session}.` : "First the session that has the test, then the file."}{" "}
        <ChooseSession label="Session" placeholder={base ? base.session : "choose …"} open={setBase} />
      </p>
      <Drop words={wanted(base, file)} open={receive} failed={setFault} />
      {fault !== undefined && <FaultBox fault={faultOf(fault)} />}
      {found && (
        <p>
          <label>
            Test{" "}
            <select
              aria-label="Test"
              value={test}
              onChange={(event) => {
                setTest(Number(event.currentTarget.value));
                forget();
              }}
            >
              {found.tests.map((name, k) => (
                <option key={name} value={k}>
                  {name}
                </option>
              ))}
            </select>
          </label>
        </p>
      )}
      {found && file && layout && (
        <>
          <h2>Layout of {file.name}</h2>
          <p class="actions">
            <Choice
              label="Separator"
              value={layout.separator}
              of={SEPARATORS}
              set={(separator) => set({ separator })}
            />
            <Choice
              label="Decimal sign"
              value={layout.decimal}
              of={[
                [".", "point"],
                [",", "comma"],
              ]}
              set={(decimal) => set({ decimal })}
            />
            <Choice label="Encoding" value={layout.encoding} of={ENCODINGS} set={(encoding) => set({ encoding })} />
            <label>
              Lines above{" "}
              <NumberField
                value={layout.skip}
                of={file}
                min={0}
                max={1000}
                step={1}
                refused={(lines) => (Number.isInteger(lines) && lines >= 0 ? undefined : "lines are counted from 0")}
                set={(skip) => set({ skip })}
              />
            </label>
            <label>
              <input
                type="checkbox"
                checked={layout.header}
                onChange={(event) => set({ header: event.currentTarget.checked })}
              />{" "}
              a header line
            </label>
          </p>
          <Scroll label="First rows and meanings of the columns">
            <table>
              <thead>
                <tr>
                  {layout.columns.map((own, k) => (
                    <th key={k}>
                      <select
                        aria-label={`Column ${k + 1}`}
                        value={own ?? ""}
                        onChange={(event) => {
                          const name = event.currentTarget.value || undefined;
                          set({
                            columns: layout.columns.map((old, i) => (i === k ? name : old === name ? undefined : old)),
                          });
                        }}
                      >
                        <option value="">not used</option>
                        {found.columns
                          .flatMap(({ stem, units }) =>
                            units.length ? units.map((unit) => `${stem}_${unit}`) : [stem],
                          )
                          .map((name) => (
                            <option key={name}>{name}</option>
                          ))}
                      </select>
                    </th>
                  ))}
                </tr>
              </thead>
              <tbody>
                {rows.map((row, k) => (
                  <tr key={k}>
                    {layout.columns.map((_, column) => (
                      <td key={column}>{row[column] ?? ""}</td>
                    ))}
                  </tr>
                ))}
              </tbody>
            </table>
          </Scroll>
          <p class="actions">
            <button class="main" disabled={work !== undefined} onClick={() => void tryAll()}>
              Fit, and the same with other guesses
            </button>
            <button disabled={!work} onClick={stop}>
              Stop
            </button>
            <button onClick={use}>Open in Analyse</button>
            <Status work={work} note={note} />
          </p>
          {tried.length > 0 && (
            <Scroll label="Residuals of the guesses">
              <table>
                <thead>
                  <tr>
                    <th>guess</th>
                    <th>rms of the residual, µm</th>
                  </tr>
                </thead>
                <tbody>
                  {tried.map((one) => (
                    <tr key={one.words}>
                      <td>{one.words}</td>
                      <td>{one.fault ?? one.rms_um?.toPrecision(4)}</td>
                    </tr>
                  ))}
                </tbody>
              </table>
            </Scroll>
          )}
        </>
      )}
    </>
  );
}

/** What is dropped next. */
function wanted(base?: Opened, file?: Foreign): string {
  if (!base) return `${file ? `The file is ${file.name}. ` : ""}Drop the files of the session that has the test here.`;
  return file ? `The file is ${file.name}. Drop another here.` : "Drop the file of readings here (.csv, .txt).";
}

function Choice<T extends string>({
  label,
  value,
  of,
  set,
}: {
  label: string;
  value: T;
  of: readonly (readonly [T, string])[];
  set: (value: T) => void;
}) {
  return (
    <label>
      {label}{" "}
      <select value={value} onChange={(event) => set(event.currentTarget.value as T)}>
        {of.map(([word, words]) => (
          <option key={word} value={word}>
            {words}
          </option>
        ))}
      </select>
    </label>
  );
}
