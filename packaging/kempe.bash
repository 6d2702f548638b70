# SPDX-License-Identifier: BSD-3-Clause
# shellcheck shell=bash disable=SC2207
# Bash completion for kempe: commands, then the options that the command's own help lists, then model files.
_kempe() {
    local word=${COMP_WORDS[COMP_CWORD]} command=${COMP_WORDS[1]:-}
    if [ "$COMP_CWORD" -eq 1 ]; then
        COMPREPLY=($(compgen -W "$(kempe --help | awk '/^commands:/{on=1;next} /^$/{on=0} on{print $1}') --help --version" -- "$word"))
    elif [[ $word == -* ]]; then
        COMPREPLY=($(compgen -W "$(kempe "$command" --help 2>/dev/null | grep -oE -- '--[a-z-]+' | sort -u)" -- "$word"))
    else
        COMPREPLY=($(compgen -f -X '!*.yaml' -- "$word") $(compgen -f -X '!*.mbs' -- "$word") $(compgen -d -S / -- "$word"))
    fi
}
complete -o nospace -o filenames -F _kempe kempe
