"""``python -m postproc`` is the console script ``compensate``."""

import signal


def main() -> None:
    """Entry point of the console script."""
    # a Ctrl-C before the command is loaded ends the process as in a shell, without a traceback
    if signal.getsignal(signal.SIGINT) == signal.default_int_handler:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    from postproc.cli.main import run

    run()


if __name__ == "__main__":
    main()
