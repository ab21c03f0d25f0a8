// Import: foreign files become tests of a session, as the command `abbe import` makes it. The library understands the
// files; the page asks for what the command has as options, and shows how they were understood.

import { useEffect, useRef, useState } from "preact/hooks";
import { bundledText, machines } from "./bundled";
import { ChooseSession } from "./choose-session";
import { Drop } from "./drop";
import { Engine, isStopped } from "./engine";
import { FaultBox, faultOf } from "./fault";
import { beside, type FileMap, sessionsIn } from "./files";
import type { Opened } from "./main";
import type { Fault } from "./protocol";
import { begun, Status, type Work } from "./status";
import { type Understood, UnderstoodView } from "./understood";
import { keptValue, useKeeping, useUnsaved } from "./work";

/** A file of another program. */
interface Foreign {
  name: string;
  bytes: Uint8Array;
}

/** What another view hands over: the session to which tests are added, a file of readings, or both. */
export interface Importable {
  base?: Opened;
  file?: Foreign;
}

/** Where the tests go: into a new session of a machine, or into one that exists. */
interface Target {
  files: FileMap;
  /** The machine file of a new session, and its name. */
  machine?: string;
  words: string;
  session?: string;
}

/** What the user says, as the options of the command. */
interface Said {
  kind: string;
  set: string;
  columns: string;
  like: string;
  allowImplausible: boolean;
}

const NOTHING: Said = { kind: "", set: "", columns: "", like: "", allowImplausible: false };

/** Folder of the foreign files: one may have the name of a file of the session. */
const FOREIGN = "foreign files/";

const intoSession = ({ files, session }: Opened): Target => ({ files, session, words: session });

function ofBundled(path: string): Target {
  const name = path.slice(path.lastIndexOf("/") + 1);
  const words = machines.find(([own]) => own === path)?.[1] ?? name;
  return { files: new Map([[name, new TextEncoder().encode(bundledText(path))]]), machine: name, words };
}

/** The lines of a text that say something. */
const lines = (text: string): string[] =>
  text
    .split("\n")
    .map((line) => line.trim())
    .filter((line) => line !== "");

/** The text with what a column is said to be; the other lines stay. */
function withColumn(text: string, number: number, own: string): string {
  const others = lines(text).filter((line) => line.split("=")[1]?.trim() !== String(number));
  return [...others, ...(own ? [`${own}=${number}`] : [])].join("\n");
}

export function Wizard({ opened, analyse }: { opened?: Importable; analyse: (opened: Opened) => void }) {
  const engine = useRef<Engine | undefined>(undefined);
  engine.current ??= new Engine();
  const keeping = useKeeping();
  const [files, setFiles] = useState<Foreign[]>(() => keptValue(keeping, "import files") ?? []);
  const [target, setTarget] = useState<Target | undefined>(() => keptValue(keeping, "import target"));
  const [said, setSaid] = useState<Said>(() => keptValue(keeping, "import said") ?? NOTHING);
  const [found, setFound] = useState<Understood>();
  const [kinds, setKinds] = useState<string[]>([]);
  const [work, setWork] = useState<Work>();
  const [note, setNote] = useState("");
  const [fault, setFault] = useState<Fault>();
  useUnsaved("Import", work !== undefined);
  useEffect(() => keeping.store.keep("import files", files), [files]);
  useEffect(() => keeping.store.keep("import target", target), [target]);
  useEffect(() => keeping.store.keep("import said", said), [said]);
  useEffect(() => {
    if (!opened) return;
    if (opened.base) setTarget(intoSession(opened.base));
    setFiles(opened.file ? [opened.file] : []);
    setSaid(NOTHING);
  }, [opened]);
  /** Number of what is asked for: the answer to an earlier question is not told. */
  const asked = useRef(0);
  useEffect(() => {
    void ask();
  }, [files, target, said]);

  const ask = async () => {
    const number = ++asked.current;
    engine.current?.stop();
    setFound(undefined);
    setFault(undefined);
    setNote("");
    setWork(undefined);
    if (files.length === 0 || !target) return;
    setWork(begun(files.length === 1 ? `reading ${files[0].name}` : `reading ${files.length} files`));
    const foreign = files.map(({ name, bytes }) => [`${FOREIGN}${name}`, bytes] as [string, Uint8Array]);
    const question = {
      files: foreign.map(([path]) => path),
      machine: target.machine ?? null,
      session: target.session ?? null,
      kind: said.kind || null,
      set: lines(said.set),
      columns: lines(said.columns),
      like: said.like || null,
      allow_implausible: said.allowImplausible,
    };
    try {
      setKinds((await engine.current?.call<string[]>("instruments")) ?? []);
      const folder = [...target.files, ...foreign];
      const answer = await engine.current?.call<Understood>("import", [question], { files: folder });
      if (number === asked.current) setFound(answer);
    } catch (error) {
      if (number === asked.current && !isStopped(error)) setFault(faultOf(error));
    }
    if (number === asked.current) setWork(undefined);
  };
  const stop = () => {
    asked.current += 1;
    engine.current?.stop();
    setWork(undefined);
    setNote("stopped");
  };
  const say = (part: Partial<Said>) => setSaid({ ...said, ...part });
  /** Takes the session or the machine to which the tests belong, and files of readings. */
  const receive = (dropped: FileMap) => {
    const [session] = sessionsIn(dropped);
    if (session !== undefined) {
      setTarget(intoSession({ files: dropped, session }));
      return;
    }
    const [machine] = [...dropped.keys()].filter((path) => path.endsWith(".toml"));
    if (machine !== undefined) setTarget({ files: dropped, machine, words: machine });
    const tables = [...dropped].filter(([path]) => !path.endsWith(".toml"));
    const named = tables.map(([path, bytes]) => ({ name: path.split("/").pop() ?? path, bytes }));
    if (named.length === 0) return;
    const others = files.filter(({ name }) => !named.some((one) => one.name === name));
    setFiles([...others, ...named]);
  };
  const use = () => {
    if (!found || !target) return;
    const session = target.session ?? found.result.session;
    const made = found.files.map(([name, bytes]) => [beside(session, name), bytes] as const);
    if (target.session === undefined) {
      analyse({ files: new Map(made), session });
    } else {
      const all = new Map([...target.files, ...made]);
      analyse({ files: all, session, base: target.files });
      // The next files go into the same session.
      setTarget(intoSession({ files: all, session }));
    }
    setFiles([]);
    setSaid(NOTHING);
  };
  return (
    <>
      <p>
        Each file of another program becomes a test, in a new session of a machine or in a session that exists, as the
        command <code>abbe import</code> does it.
      </p>
      <Drop
        words={
          files.length === 0
            ? "Drop files of readings here (.csv, .txt, …), and the machine file or the session if you have one."
            : `Files: ${files.map(({ name }) => name).join(", ")}. Drop more, the machine or the session here.`
        }
        open={receive}
        failed={(error) => setFault(faultOf(error))}
      />
      <p class="actions target">
        <label>
          Machine of a new session{" "}
          <select
            aria-label="Machine"
            value=""
            onChange={(event) => {
              const path = event.currentTarget.value;
              if (path) setTarget(ofBundled(path));
            }}
          >
            <option value="">{target?.machine ? target.words : "choose …"}</option>
            {machines.map(([path, name]) => (
              <option key={path} value={path}>
                {name} ({path.split("/")[0]})
              </option>
            ))}
          </select>
        </label>
        <ChooseSession
          label="Session"
          placeholder={target?.session ?? "or add to a session …"}
          open={(one) => setTarget(intoSession(one))}
        />
        {files.length > 0 && <button onClick={() => setFiles([])}>Forget the files</button>}
        {work && <button onClick={stop}>Stop</button>}
        {note && <button onClick={() => void ask()}>Read again</button>}
        <Status work={work} note={note} />
      </p>
      {files.length > 0 && !target && (
        <p>Choose the machine on which they were read, or the session to which they belong.</p>
      )}
      {target && (
        <p>{target.session ? `The tests go into ${target.session}.` : `The tests go into a new session: ${target.words}.`}</p>
      )}
      {fault && <FaultBox fault={fault} />}
      {files.length > 0 && target && (
        <details open={fault !== undefined || Object.values(said).some(Boolean)}>
          <summary>Say more about the files</summary>
          <div class="said">
            {target.machine && (
              <label>
                Instrument
                <select value={said.kind} onChange={(event) => say({ kind: event.currentTarget.value })}>
                  <option value="">as the columns tell</option>
                  {kinds.map((kind) => (
                    <option key={kind}>{kind}</option>
                  ))}
                </select>
              </label>
            )}
            {target.session && (
              <label>
                New tests are set up like
                <input
                  value={said.like}
                  placeholder="a test of the session"
                  onChange={(event) => say({ like: event.currentTarget.value.trim() })}
                />
              </label>
            )}
            <label>
              Keys of the new tests, one a line
              <textarea
                rows={3}
                value={said.set}
                placeholder="bar_mm=150"
                onChange={(event) => say({ set: event.currentTarget.value })}
              />
            </label>
            <label>
              What columns hold, by name or number
              <textarea
                rows={3}
                value={said.columns}
                placeholder="c_deg=3"
                onChange={(event) => say({ columns: event.currentTarget.value })}
              />
            </label>
            <label class="check">
              <input
                type="checkbox"
                checked={said.allowImplausible}
                onChange={(event) => say({ allowImplausible: event.currentTarget.checked })}
              />{" "}
              accept readings that contradict the machine
            </label>
          </div>
        </details>
      )}
      {found && (
        <UnderstoodView
          found={found}
          say={(number, own) => say({ columns: withColumn(said.columns, number, own) })}
          use={use}
        />
      )}
    </>
  );
}
