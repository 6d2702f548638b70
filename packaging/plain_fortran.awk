# SPDX-License-Identifier: BSD-3-Clause
# Fortran 77 as f2c reads it: it knows neither EXIT and CYCLE, which become jumps to a label of their loop, nor RECURSIVE, nor AIMAG of
# double precision. Used by packaging/build_wasm.
function label(number) { return sprintf("%5d CONTINUE", number) }
/^[^ \t0-9]/ { print; next }
{ gsub(/RECURSIVE /, ""); gsub(/AIMAG\(/, "DIMAG(") }
/^ +DO +([0-9]+ +)?[A-Z]/ {
    depth++
    last[depth] = $2 ~ /^[0-9]+$/ ? $2 : ""
    first[depth] = 90000 + 2 * ++loops
    exits[depth] = cycles[depth] = 0
    print
    next
}
/^ +END *DO/ || (depth && last[depth] != "" && $1 == last[depth]) {
    ended = last[depth]
    do {
        if (cycles[depth]) print label(first[depth] + 1)
        if (last[depth] == "" || last[depth - 1] != ended) print
        if (exits[depth]) print label(first[depth])
        depth--
    } while (ended != "" && depth && last[depth] == ended)
    next
}
/[ )$]EXIT *$/ { exits[depth] = 1; sub("EXIT *$", "GOTO " first[depth]) }
/[ )$]CYCLE *$/ { cycles[depth] = 1; sub("CYCLE *$", "GOTO " first[depth] + 1) }
{ print }
