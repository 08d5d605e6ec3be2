"""Rules on watch: what they look at, latched and timed, from tick outputs in pieces. docs/rules.md."""
