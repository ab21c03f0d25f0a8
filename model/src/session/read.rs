//! Machine and session files.
