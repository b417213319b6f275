"""The subcommands of `inelastic`, one file each; `command_line` assembles them."""
