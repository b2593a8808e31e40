#pragma once

namespace deepuav {

/// From now on SIGINT and SIGTERM are remembered, so that the work at hand can be finished and
/// saved. A second one ends the program at once.
void CatchSignals();

/// The signal received since, or 0. Thread-safe.
int SignalReceived();

/// Throws ExitStatus as of a program that a signal ended, if one was received.
void ExitIfInterrupted();

}  // namespace deepuav
