"""Mutation testing of the rooms that decide a correction (``python -m tests.mutation FOLDER``)."""
