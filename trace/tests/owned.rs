//! The outcome of a trace outlives the session that was passed in, and crosses threads.

#[test]
fn a_trace_owns_what_it_needs() {
    fn owned<T: Send + Sync + 'static>() {}
    owned::<abbe_trace::TraceOutcome>();
    owned::<abbe_trace::SessionFit>();
}
