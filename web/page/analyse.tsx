// Analyse: a session, its text with faults, fit and trace, the report.

import { zipSync } from "fflate";
import { useEffect, useRef, useState } from "preact/hooks";
import { ChooseSession } from "./choose-session";
import { Drop } from "./drop";
import { Editor } from "./editor";
import { Engine, isStopped } from "./engine";
import { FaultBox, faultOf } from "./fault";
import { beside, download, type FileMap, isEditable, isTable, sessionsIn, text } from "./files";
import { FirstScreen } from "./first-screen";
import type { Importable } from "./import";
import type { Opened } from "./main";
import type { Fault } from "./protocol";
import { type Result, ResultView } from "./result";
import { begun, Status, type Work } from "./status";
import { type Checked, Summary } from "./summary";
import { together, told, withMade } from "./together";
import { type Keeping, keptValue, useKeeping, useUnsaved } from "./work";

interface Props {
  opened?: Opened;
  explore: (opened: Opened) => void;
  imports: (what: Importable) => void;
}

/** What is open: files, the session among them, the file in the editor. */
interface Desk {
  files: FileMap;
  session: string;
  shown: string;
  result?: Result;
  /** Whether it was changed here and is on no disk. */
  isChanged: boolean;
}

const EMPTY: Desk = { files: new Map(), session: "", shown: "", isChanged: false };

export function Analyse({ opened, explore, imports }: Props) {
  const engine = useRef<Engine | undefined>(undefined);
  engine.current ??= new Engine();
  const keeping = useKeeping();
  const [desk, setDesk] = useState<Desk>(() => kept(keeping));
  const { files, session, shown, result } = desk;
  const [checked, setChecked] = useState<Checked>();
  const [fault, setFault] = useState<Fault>();
  const [work, setWork] = useState<Work>();
  const [reading, setReading] = useState<Work>();
  /** What was done last, in words, and what was open before. */
  const [note, setNote] = useState("");
  const [before, setBefore] = useState<Desk>();
  useUnsaved("Analyse", work !== undefined || desk.isChanged);

  /** Number of what is open, a folder with a text and a session: what was begun with another is not told. */
  const opening = useRef(0);
  const begin = () => {
    opening.current += 1;
    if (work || reading) engine.current?.stop();
    setWork(undefined);
    setReading(undefined);
    return opening.current;
  };
  /** Opens another state of the desk, and reads its session. */
  const show = (next: Desk) => {
    begin();
    setDesk(next);
    setChecked(undefined);
    setFault(undefined);
    if (next.session) void check(next.files, next.session);
  };
  useEffect(() => {
    keeping.store.keepFiles(files);
  }, [files]);
  useEffect(
    () => keeping.store.keep("desk", { session, shown, isChanged: desk.isChanged }),
    [session, shown, desk.isChanged],
  );
  useEffect(() => keeping.store.keep("result", result), [result]);
  useEffect(() => {
    if (session) void check(files, session);
  }, []);

  const check = async (of: FileMap, path: string) => {
    const number = opening.current;
    setFault(undefined);
    setReading(begun(`reading ${of.size} files`));
    try {
      const found = await engine.current?.call<Checked>("check", [path], { files: of });
      if (number === opening.current) setChecked(found);
    } catch (error) {
      if (number !== opening.current) return;
      setChecked(undefined);
      failed(error, of);
    }
    if (number === opening.current) setReading(undefined);
  };
  const failed = (error: unknown, of: FileMap = files) => {
    const found = faultOf(error);
    setFault(found);
    const { file } = found;
    if (file && isEditable(of.get(file))) setDesk((desk) => ({ ...desk, shown: file }));
  };
  /** Takes files to those that are open; readings that no session names go to the import. */
  const receive = (dropped: FileMap, wanted?: string, isMade = false) => {
    const [own] = wanted ? [wanted] : sessionsIn(dropped);
    // Files without a session belong to the open one, and lie beside it.
    const isPart = own === undefined && session !== "";
    const others = isPart ? new Map([...dropped].map(([path, bytes]) => [beside(session, path), bytes])) : dropped;
    const [first] = others;
    if (!first) return;
    const [name, bytes] = first;
    if (own === undefined && others.size === 1 && isTable(name, bytes) && !isNamed(files, name)) {
      imports({ base: session ? { files, session } : undefined, file: { name, bytes } });
      return;
    }
    try {
      const all = together(files, others);
      const next = own === undefined ? session || sessionsIn(all.files)[0] : `${all.folder}${own}`;
      if (files.size > 0) {
        setBefore(desk);
        setNote(told(all));
      }
      if (next === undefined) {
        setDesk({ ...desk, files: all.files });
        setFault({
          message:
            "no session file among these files: a session is a .toml file with [[test]]. They stay open: drop it too",
        });
        return;
      }
      const isChange = all.added.length + all.replaced.length > 0;
      if (!isChange && next === session) return setFault(undefined);
      show({
        files: all.files,
        session: next,
        shown: next === session ? shown : next,
        isChanged: desk.isChanged || isMade,
      });
    } catch (error) {
      setFault(faultOf(error));
    }
  };
  useEffect(() => {
    if (!opened) return;
    const { base } = opened;
    const made = base && withMade(files, base, opened.files);
    if (!made) return receive(opened.files, opened.session, base !== undefined);
    setBefore(desk);
    setNote("the imported readings are in the session");
    show({ files: made, session: opened.session, shown: opened.session, isChanged: true });
  }, [opened]);

  const timer = useRef<ReturnType<typeof setTimeout> | undefined>(undefined);
  const edit = (changed: string) => {
    const next = new Map(files).set(shown, new TextEncoder().encode(changed));
    const number = begin();
    setDesk({ ...desk, files: next, result: undefined, isChanged: true });
    // What was open before has not what is written now.
    setBefore(undefined);
    setNote("");
    clearTimeout(timer.current);
    timer.current = setTimeout(() => {
      if (number === opening.current) void check(next, session);
    }, 400);
  };
  const run = async (kind: "fit" | "trace") => {
    const number = begin();
    setFault(undefined);
    setNote("");
    setBefore(undefined);
    const readings = checked?.tests.reduce((sum, test) => sum + test.readings, 0) ?? 0;
    const { since } = begun("");
    const tell = (words: string) => number === opening.current && setWork({ words, since });
    tell(kind === "fit" ? `fitting ${readings} readings` : `reading ${readings} readings`);
    try {
      const found = await engine.current?.call<Omit<Result, "kind" | "seconds">>(kind, [session], {
        files,
        progress: tell,
      });
      const seconds = (performance.now() - since) / 1000;
      if (number !== opening.current) return;
      if (found) setDesk((desk) => ({ ...desk, result: { ...found, kind, seconds } }));
    } catch (error) {
      if (number !== opening.current) return;
      if (!isStopped(error)) failed(error);
      else setNote(result ? `${kind} stopped; the ${result.kind} before stays` : `${kind} stopped`);
    }
    setWork(undefined);
  };
  const stem =
    session
      .split("/")
      .pop()
      ?.replace(/\.toml$/, "") || "session";
  const zip = () => {
    download(`${stem}.zip`, new Uint8Array(zipSync(Object.fromEntries(files))), "application/zip");
    setDesk({ ...desk, isChanged: false });
  };
  const close = () => {
    setBefore(desk);
    setNote(`closed ${session || "the files"}`);
    show(EMPTY);
  };
  const undo = () => {
    if (before) show(before);
    setBefore(undefined);
    setNote("");
  };
  /** Tests that are no part of a plan: their data say how the axes moved. */
  const still = checked?.tests.filter((test) => !test.moves).map((test) => test.name) ?? [];
  const editable = [...files].filter(([, bytes]) => isEditable(bytes)).map(([path]) => path);
  const start = ({ files, session }: Opened) => receive(files, session);
  return (
    <>
      {!session && <FirstScreen open={start} explore={explore} />}
      <Drop
        words={
          files.size > 0
            ? `Open: ${files.size} ${files.size === 1 ? "file" : "files"}. What you drop here is added.`
            : "Drop a session here: its folder, a ZIP file of it, or its files (.toml, .csv, .xlsx); a CSV alone is imported."
        }
        folders
        open={receive}
        failed={failed}
      />
      <p class="actions">
        <ChooseSession label="Or open a bundled session" placeholder="choose …" open={start} />
        {files.size > 0 && <button onClick={close}>Close</button>}
        <span class="note" aria-live="polite">
          {note}
        </span>
        {before && <button onClick={undo}>Undo</button>}
      </p>
      {fault && (
        <FaultBox
          fault={fault}
          go={({ file }) => {
            if (!file || !files.has(file)) return;
            setDesk({ ...desk, shown: file });
            setFault({ ...fault });
          }}
        />
      )}
      {session && (
        <>
          <p>
            <label>
              Session{" "}
              <select
                aria-label="Session"
                value={session}
                onChange={(event) => {
                  const path = event.currentTarget.value;
                  show({ ...desk, session: path, shown: path, result: undefined });
                }}
              >
                {[...new Set([session, ...sessionsIn(files)])].map((path) => (
                  <option key={path}>{path}</option>
                ))}
              </select>
            </label>
          </p>
          {checked && <Summary checked={checked} />}
          <p class="actions">
            <button class="main" disabled={work !== undefined || !checked} onClick={() => void run("fit")}>
              Fit
            </button>
            <button class="main" disabled={work !== undefined || !checked} onClick={() => void run("trace")}>
              Trace
            </button>
            <button disabled={!work} onClick={() => engine.current?.stop()}>
              Stop
            </button>
            <button
              disabled={!checked || still.length > 0}
              title={still.length ? `without a sweep or a path: ${still.join(", ")}` : undefined}
              onClick={() => explore({ files, session })}
            >
              Explore
            </button>
            <button onClick={() => imports({ base: { files, session } })}>Import readings</button>
            <button onClick={zip}>Download the session</button>
            <Status work={work ?? reading} />
          </p>
          {still.length > 0 && (
            <p class="note">
              Explore needs the motion of every test, a sweep or a path. These have their readings only:{" "}
              {still.join(", ")}.
            </p>
          )}
          {result && <ResultView result={result} stem={stem} />}
          <details open={!result}>
            <summary>Files</summary>
            <p>
              <label>
                File{" "}
                <select
                  aria-label="File"
                  value={shown}
                  onChange={(event) => setDesk({ ...desk, shown: event.currentTarget.value })}
                >
                  {[...new Set([...editable, shown])].map((path) => (
                    <option key={path}>{path}</option>
                  ))}
                </select>
              </label>
            </p>
            {editable.includes(shown) ? (
              <Editor
                name={shown}
                text={text(files, shown)}
                fault={fault?.file === shown ? fault : undefined}
                change={edit}
              />
            ) : (
              <p class="note">Texts in UTF-8 up to 1 MiB can be edited here; {shown} is larger, or is no such text.</p>
            )}
          </details>
        </>
      )}
    </>
  );
}

/** What this page had open before it was loaded. */
function kept(keeping: Keeping): Desk {
  const desk = keptValue<Omit<Desk, "files" | "result">>(keeping, "desk");
  const files = keeping.kept?.files;
  if (!desk || !files?.has(desk.session)) return EMPTY;
  return { ...desk, files, result: keptValue<Result>(keeping, "result") };
}

/** Whether a session that is open names a file of readings. */
function isNamed(files: FileMap, path: string): boolean {
  const name = path.split("/").pop() ?? path;
  const texts = sessionsIn(files).map((session) => text(files, session));
  return texts.some((text) => [`"${name}"`, `/${name}"`, `'${name}'`, `/${name}'`].some((one) => text.includes(one)));
}
