// Analyse: a session, its text with faults, fit and trace, the report.

import { zipSync } from "fflate";
import { useEffect, useRef, useState } from "preact/hooks";
import { ChooseSession } from "./choose-session";
import { Drop } from "./drop";
import { Editor } from "./editor";
import { Engine } from "./engine";
import { FaultBox, faultOf } from "./fault";
import { download, type FileMap, isEditable, sessionsIn, text } from "./files";
import type { Opened } from "./main";
import type { Fault } from "./protocol";

interface Checked {
  machine: string;
  instrument: string;
  tests: { name: string; readings: number; moves: boolean }[];
  effects: string[];
  warnings: string[];
}

interface Result {
  kind: "fit" | "trace";
  json: string;
  report: string;
  session?: string;
  seconds: number;
  bytes: number;
}

interface Props {
  opened?: Opened;
  explore: (opened: Opened) => void;
  imports: (opened: Opened) => void;
}

export function Analyse({ opened, explore, imports }: Props) {
  const engine = useRef<Engine | undefined>(undefined);
  engine.current ??= new Engine();
  const [files, setFiles] = useState<FileMap>(new Map());
  const [session, setSession] = useState("");
  const [shown, setShown] = useState("");
  const [checked, setChecked] = useState<Checked>();
  const [fault, setFault] = useState<Fault>();
  const [working, setWorking] = useState("");
  const [result, setResult] = useState<Result>();

  /** Number of what is open, a folder with a text and a session: what was begun with another is not told. */
  const opening = useRef(0);
  const begin = () => {
    opening.current += 1;
    if (working) engine.current?.stop();
    setResult(undefined);
    return opening.current;
  };
  const open = (next: FileMap, path?: string) => {
    const first = path ?? sessionsIn(next)[0];
    if (first === undefined) {
      setFault({ message: "no session file among these files: a session is a .toml file with [[test]]" });
      return;
    }
    begin();
    engine.current?.stop();
    setFiles(next);
    setSession(first);
    setShown(first);
    setChecked(undefined);
    void check(next, first);
  };
  useEffect(() => {
    if (opened) open(opened.files, opened.session);
  }, [opened]);

  const check = async (of: FileMap, path: string) => {
    const number = opening.current;
    setFault(undefined);
    try {
      const found = await engine.current?.call<Checked>("check", [path], { files: of });
      if (number === opening.current) setChecked(found);
    } catch (error) {
      if (number !== opening.current) return;
      setChecked(undefined);
      failed(error, of);
    }
  };
  const failed = (error: unknown, of: FileMap = files) => {
    const found = faultOf(error);
    setFault(found);
    if (found.file && isEditable(of.get(found.file))) setShown(found.file);
  };
  const timer = useRef<ReturnType<typeof setTimeout> | undefined>(undefined);
  const edit = (changed: string) => {
    const next = new Map(files).set(shown, new TextEncoder().encode(changed));
    const number = begin();
    setFiles(next);
    clearTimeout(timer.current);
    timer.current = setTimeout(() => {
      if (number === opening.current) void check(next, session);
    }, 400);
  };
  const run = async (kind: "fit" | "trace") => {
    const number = begin();
    setFault(undefined);
    setWorking(kind === "fit" ? "fitting" : "reading the session");
    const start = performance.now();
    try {
      const found = await engine.current?.call<Omit<Result, "kind" | "seconds">>(kind, [session], {
        files,
        progress: setWorking,
      });
      const seconds = (performance.now() - start) / 1000;
      if (found && number === opening.current) setResult({ ...found, kind, seconds });
    } catch (error) {
      if (number === opening.current) failed(error);
    }
    setWorking("");
  };
  const stem =
    session
      .split("/")
      .pop()
      ?.replace(/\.toml$/, "") || "session";
  const save = async (method: "csv" | "residuals" | "model", name: string) => {
    try {
      download(name, (await engine.current?.call<string>(method)) ?? "");
    } catch (error) {
      failed(error);
    }
  };
  const zip = () => download(`${stem}.zip`, new Uint8Array(zipSync(Object.fromEntries(files))), "application/zip");
  /** Tests that are no part of a plan: their data say how the axes moved. */
  const still = checked?.tests.filter((test) => !test.moves).map((test) => test.name) ?? [];
  const editable = [...files].filter(([, bytes]) => isEditable(bytes)).map(([path]) => path);
  return (
    <>
      <Drop
        words="Drop a session here: its folder, a ZIP file of it, or its files (.toml, .csv, .xlsx)."
        folders
        open={open}
        failed={failed}
      />
      <p>
        <ChooseSession
          label="Or open a bundled session"
          placeholder="choose …"
          open={({ files, session }) => open(files, session)}
        />
      </p>
      {fault && (
        <FaultBox
          fault={fault}
          go={(at) => at.file && files.has(at.file) && (setShown(at.file), setFault({ ...at }))}
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
                  begin();
                  setSession(path);
                  setShown(path);
                  setChecked(undefined);
                  void check(files, path);
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
            <button class="main" disabled={working !== "" || !checked} onClick={() => void run("fit")}>
              Fit
            </button>
            <button class="main" disabled={working !== "" || !checked} onClick={() => void run("trace")}>
              Trace
            </button>
            <button disabled={working === ""} onClick={() => engine.current?.stop()}>
              Stop
            </button>
            <button
              disabled={!checked || still.length > 0}
              title={still.length ? `without a sweep or a path: ${still.join(", ")}` : undefined}
              onClick={() => explore({ files, session })}
            >
              Explore
            </button>
            <button onClick={() => imports({ files, session })}>Import readings</button>
            <button onClick={zip}>Download the session</button>
            <span role="status">{working}</span>
          </p>
          {still.length > 0 && (
            <p class="note">
              Explore needs the motion of every test, a sweep or a path. These have their readings only:{" "}
              {still.join(", ")}.
            </p>
          )}
          {result && (
            <>
              <p class="actions" data-kind={result.kind} data-seconds={result.seconds} data-bytes={result.bytes}>
                <button onClick={() => download(`${stem}-${result.kind}.json`, result.json, "application/json")}>
                  JSON
                </button>
                <button onClick={() => void save("csv", `${stem}-${result.kind}.csv`)}>CSV</button>
                <button onClick={() => void save("residuals", `${stem}-residuals.csv`)}>Residuals</button>
                <button onClick={() => download(`${stem}-${result.kind}.html`, result.report, "text/html")}>
                  Report
                </button>
                <button onClick={() => void save("model", `${stem}-model.json`)}>Model</button>
                {result.session !== undefined && (
                  <button onClick={() => download(`${stem}-next.toml`, result.session ?? "")}>Continued session</button>
                )}
                <span>
                  {result.kind} in {result.seconds.toFixed(1)} s, {(result.bytes / 2 ** 20).toFixed(0)} MiB
                </span>
              </p>
              <iframe title="Report" sandbox="allow-scripts allow-downloads" srcdoc={result.report} />
            </>
          )}
          <details open={!result}>
            <summary>Files</summary>
            <p>
              <label>
                File{" "}
                <select value={shown} onChange={(event) => setShown(event.currentTarget.value)}>
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

function Summary({ checked }: { checked: Checked }) {
  const readings = checked.tests.reduce((sum, test) => sum + test.readings, 0);
  return (
    <div class="summary">
      <p>
        {checked.machine}, {checked.instrument}: {checked.tests.map((test) => test.name).join(", ")};{" "}
        {readings ? `${readings} readings` : "a plan without readings"}
        {checked.effects.length > 0 && `; declared effects: ${checked.effects.join(", ")}`}
      </p>
      {checked.warnings.length > 0 && (
        <ul class="warning">
          {checked.warnings.map((warning) => (
            <li key={warning}>{warning}</li>
          ))}
        </ul>
      )}
    </div>
  );
}
