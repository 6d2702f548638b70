#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Writes kempe.1 from the command's own help, so that the two cannot differ: packaging/man.sh PATH/TO/kempe > kempe.1
set -euo pipefail
kempe=${1:?usage: packaging/man.sh PATH/TO/kempe}

# Text as it stands: backslashes, leading dots and quotes are roff's.
verbatim() {
    sed -e 's/\\/\\e/g' -e "s/^\([.']\)/\\\\\&\1/" -e 's/-/\\-/g'
}

version=$("$kempe" --version)
printf '.TH KEMPE 1 "" "%s" "User commands"\n' "$version"
printf '.SH NAME\nkempe \\- simulation of mechanisms with closed kinematic loops\n'
printf '.SH SYNOPSIS\n.B kempe\n.I COMMAND FILE\n.RI [ options ]\n'
printf '.SH DESCRIPTION\n.nf\n'
"$kempe" --help | tail -n +4 | verbatim
printf '.fi\n'
for command in $("$kempe" --help | awk '/^commands:/{on=1;next} /^$/{on=0} on{print $1}'); do
    printf '.SH kempe %s\n.nf\n' "$command"
    "$kempe" "$command" --help | verbatim
    printf '.fi\n'
done
printf '.SH FILES\nPages and examples are installed in share/doc/kempe of the prefix, which kempe --help prints.\n'
printf '.SH SEE ALSO\ndocs/tutorial.md, docs/model/README.md, docs/commands.md and docs/README.md, the list of all pages.\n'
