// What follows from a plan: its description, its curves, its analysis, an equation. A plan that cannot be used leaves
// those of the last one that could.

import { useEffect, useRef, useState } from "preact/hooks";
import type { Curve } from "./chart";
import { type Call, computedCurves } from "./curves";
import { Engine, isStopped } from "./engine";
import { faultOf } from "./fault";
import type { Analysis } from "./identifiability";
import { useLatest } from "./latest";
import { type Description, folderOf, type Improvement, textsOf } from "./plan";
import { BROKEN, type Fault } from "./protocol";
import type { Shared } from "./share";

export type Kind = "patterns" | "sensitivities";

export interface Followed {
  description?: Description;
  curves: Curve[][][];
  analysis?: Analysis;
  latex: string | Fault;
  fault?: Fault;
  /** The last plan that could be used. */
  valid?: Shared;
  /** The worker that knows the plan, for what takes no time. */
  engine: Engine;
  /** The proposal of a next test, which takes seconds, and its end. */
  improve: () => Promise<Improvement>;
  stop: () => void;
}

function caller(engine: Engine): Call {
  return (method, args, options) => engine.call(method, args, options);
}

/** `lastValid` is the last plan that could be used before the page was loaded. */
export function usePlan(state: Shared, kind: Kind, test: number, lastValid?: Shared): Followed {
  const engines = useRef<{ engine: Engine; thinker: Engine } | undefined>(undefined);
  engines.current ??= { engine: new Engine(), thinker: new Engine() };
  const { engine, thinker } = engines.current;
  const [description, setDescription] = useState<Description>();
  const [curves, setCurves] = useState<Curve[][][]>([]);
  const [analysis, setAnalysis] = useState<Analysis>();
  const [latex, setLatex] = useState<string | Fault>("");
  const [fault, setFault] = useState<Fault>();
  const [valid, setValid] = useState(lastValid);
  /** What is wanted, and what the worker has: the texts of its plan, and those that it refused. */
  const job = useRef({ state, kind, test, known: "", refused: "", valid: lastValid, description });
  Object.assign(job.current, { state, kind, test });

  /** Gives the worker a plan. */
  const read = async (plan: Shared) => {
    const found = await engine.call<Description>("plan", ["plan.toml"], { files: folderOf(plan) });
    Object.assign(job.current, { known: textsOf(plan), description: found, valid: plan });
    setDescription(found);
    setValid(plan);
  };
  /** Gives the worker the wanted plan, or the last one that it can use. */
  const follow = async () => {
    const { state, known, refused, valid } = job.current;
    const texts = textsOf(state);
    if (texts === known) {
      // Taken back: the fields show the plan again.
      if (refused) setDescription((before) => before && { ...before });
      job.current.refused = "";
      setFault(undefined);
    } else if (texts !== refused) {
      try {
        await read(state);
        job.current.refused = "";
        setFault(undefined);
      } catch (error) {
        job.current.refused = texts;
        setFault(faultOf(error));
        if (faultOf(error).message.startsWith(BROKEN)) job.current.known = "";
      }
    }
    if (job.current.known === "" && valid && textsOf(valid) !== job.current.refused) await read(valid);
  };
  // Curves follow at once. What takes longer has a worker of its own, so that no curve waits for it.
  const curvesNow = useLatest(async (isLatest) => {
    try {
      await follow();
      const { state, kind, description } = job.current;
      if (!description) return;
      const values = Float64Array.from(description.parameters, ({ id }) => state.values[id] ?? 0);
      setCurves(await computedCurves(description, values, kind, caller(engine)));
      if (isLatest()) analyseNow();
    } catch (error) {
      // The worker ended, and knows no plan.
      job.current.known = "";
      setFault(faultOf(error));
    }
  });
  const thought = useRef({ texts: "", test: -1 });
  const analyseNow = useLatest(async (isLatest) => {
    const { valid, test } = job.current;
    if (!valid) return;
    const texts = textsOf(valid);
    const call = caller(thinker);
    try {
      if (thought.current.texts !== texts) {
        await call("plan", ["plan.toml"], { files: folderOf(valid) });
        setAnalysis(await call<Analysis>("analysis"));
        thought.current = { texts, test: -1 };
      }
      if (!isLatest() || thought.current.test === test) return;
      setLatex(await call<string>("equation", [test]).catch(faultOf));
      thought.current.test = test;
    } catch (error) {
      thought.current.texts = "";
      if (!isStopped(error)) setFault(faultOf(error));
    }
  });
  const improve = async () => {
    if (!valid) throw new Error("there is no plan that can be used");
    await thinker.call("plan", ["plan.toml"], { files: folderOf(valid) });
    return thinker.call<Improvement>("improve");
  };
  const stop = () => {
    thinker.stop();
    thought.current = { texts: "", test: -1 };
  };
  useEffect(curvesNow, [state, kind, test]);
  useEffect(
    () => () => {
      engine.stop();
      thinker.stop();
    },
    [],
  );
  return { description, curves, analysis, latex, fault, valid, engine, improve, stop };
}
