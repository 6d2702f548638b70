# SPDX-License-Identifier: BSD-3-Clause
# shellcheck shell=bash
# Bash completion for kempe, which knows the candidates itself: `kempe complete WORD..`.
_kempe() {
    local words=() word
    for word in "${COMP_WORDS[@]:1:COMP_CWORD}"; do
        # Bash takes "--name=value" as three words.
        [ "$word" = = ] || words+=("$word")
    done
    [ "${COMP_WORDS[COMP_CWORD]}" != = ] || words+=("")
    mapfile -t COMPREPLY < <(kempe complete "${words[@]}" 2>/dev/null)
    [[ ${#COMPREPLY[@]} -ne 1 || ${COMPREPLY[0]} == */ ]] || compopt +o nospace 2>/dev/null
}
complete -o nospace -o filenames -F _kempe kempe
