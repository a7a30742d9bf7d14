"""Command line: parser, subcommands, outputs."""
