# SPDX-License-Identifier: BSD-3-Clause
# Fish completion for kempe, which knows the candidates itself: `kempe complete WORD..`.
function __kempe_complete
    set -l words (commandline -opc) (commandline -ct)
    kempe complete $words[2..-1] 2>/dev/null
end
complete -c kempe -f -a '(__kempe_complete)'
