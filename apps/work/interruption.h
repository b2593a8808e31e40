#pragma once

namespace deepuav {

/// Whatever ends the program by a signal from now on, no half-written temporary file stays. A file
/// that reaches a limit of size (`ulimit -f`) is a failure to write, like a full disk.
void CleanUpOnSignals();

/// From now on SIGINT, SIGTERM and SIGHUP are remembered, so that the work at hand can be finished
/// and saved. A second one ends the program at once.
void CatchSignals();

/// The signal received since, or 0. Thread-safe.
int SignalReceived();

/// Throws ExitStatus as of a program that a signal ended, if one was received.
void ExitIfInterrupted();

}  // namespace deepuav
