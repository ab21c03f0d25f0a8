// Import: a foreign CSV becomes the readings of a test. The wizard writes `[test.format]` and `[test.columns]`; the
// library reads the file with them.

import { useEffect, useRef, useState } from "preact/hooks";
import { ChooseSession } from "./choose-session";
import { Drop } from "./drop";
import { Engine } from "./engine";
import { FaultBox, faultOf } from "./fault";
import { beside, FileFault, type FileMap, text } from "./files";
import { ENCODINGS, guess, type Layout, type Own, rowsOf, SEPARATORS, written } from "./layout";
import type { Opened } from "./main";
import { type Variant, variants } from "./variants";

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

export function Wizard({ opened, analyse }: { opened?: Opened; analyse: (opened: Opened) => void }) {
  const engine = useRef<Engine | undefined>(undefined);
  engine.current ??= new Engine();
  const [base, setBase] = useState<Opened | undefined>(opened);
  const [found, setFound] = useState<Found>();
  const [test, setTest] = useState(0);
  const [file, setFile] = useState<{ name: string; bytes: Uint8Array }>();
  const [layout, setLayout] = useState<Layout>();
  const [tried, setTried] = useState<Tried[]>([]);
  const [working, setWorking] = useState("");
  const [fault, setFault] = useState<unknown>();

  useEffect(() => {
    if (opened) setBase(opened);
  }, [opened]);
  /** Number of what is imported into what: what was begun for another is not told. */
  const trying = useRef(0);
  const forget = () => {
    trying.current += 1;
    engine.current?.stop();
    setTried([]);
    setWorking("");
    return trying.current;
  };
  useEffect(() => {
    if (!base) return;
    const number = forget();
    setFound(undefined);
    setFile(undefined);
    setTest(0);
    setFault(undefined);
    const read = engine.current?.call<Found>("columns", [base.session], { files: base.files });
    read?.then(
      (known) => number === trying.current && setFound(known),
      (error) => number === trying.current && setFault(error),
    );
  }, [base]);

  const take = (files: FileMap) => {
    const [first] = files;
    if (!first || !found) return;
    const name = first[0].split("/").pop() ?? "readings.csv";
    if (/^PK\x03\x04|^\xd0\xcf\x11\xe0/.test(String.fromCharCode(...first[1].subarray(0, 4)))) {
      setFault(new FileFault(`${name}: this is a spreadsheet; name it as \`data\` of the test, or save it as CSV`));
      return;
    }
    forget();
    setFile({ name, bytes: first[1] });
    setLayout(guess(first[1], found.columns));
    setFault(undefined);
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
    for (const variant of [{ words: "as guessed", layout }, ...variants(layout, found.columns)] as Variant[]) {
      setWorking(`fit: ${variant.words}`);
      try {
        results.push({ words: variant.words, rms_um: await rms(variant.layout) });
      } catch (error) {
        const { message, line } = faultOf(error);
        results.push({ words: variant.words, fault: line ? `line ${line}: ${message}` : message });
      }
      if (number !== trying.current) return;
      setTried([...results]);
    }
    setWorking("");
  };
  const use = () => {
    if (!base || !file || !layout) return;
    analyse({ files: imported(base.files, base.session, test, file.name, file.bytes, layout), session: base.session });
  };
  const rows = file && layout ? rowsOf(file.bytes, layout).slice(0, 8) : [];
  return (
    <>
      <p>
        Readings of another program become those of a test. First the session that has the test, then the file.{" "}
        <ChooseSession label="Session" placeholder={base ? base.session : "choose …"} open={setBase} />
      </p>
      {fault !== undefined && <FaultBox fault={faultOf(fault)} />}
      {found && (
        <>
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
          <Drop
            words={
              file ? `The file is ${file.name}. Drop another here.` : "Drop the file of readings here (.csv, .txt)."
            }
            open={take}
            failed={setFault}
          />
        </>
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
              <input
                type="number"
                min={0}
                max={1000}
                value={layout.skip}
                onInput={(event) => set({ skip: Math.max(0, Math.round(event.currentTarget.valueAsNumber) || 0) })}
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
          <div class="scroll">
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
          </div>
          <p class="actions">
            <button class="main" disabled={working !== ""} onClick={() => void tryAll()}>
              Fit, and the same with other guesses
            </button>
            <button disabled={working === ""} onClick={forget}>
              Stop
            </button>
            <button onClick={use}>Open in Analyse</button>
            <span role="status">{working}</span>
          </p>
          {tried.length > 0 && (
            <div class="scroll">
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
            </div>
          )}
        </>
      )}
    </>
  );
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
