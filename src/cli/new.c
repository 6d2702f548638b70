/* SPDX-License-Identifier: BSD-3-Clause */
/* Writes a first model: a four-bar linkage with comments. README.md shows the same text (tests/docs.py). */
#include "command.h"
#include "element_list.h"
#include "platform/platform.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

static const char template[] =
    "kempe: 1                                     # version of the model language\n"
    "gravity: [0, -9.81, 0]                       # m/s^2, in the axes of the ground\n"
    "parameters: {crank: 300 mm, coupler: 800 mm, rocker: 700 mm, base: 900 mm, rho: 2 kg/m}\n"
    "ground: {points: {A: [0, 0, 0], D: [base, 0, 0]}}\n"
    "bodies:                                      # three uniform bars, each along its own x axis\n"
    "  crank:\n"
    "    mass: rho*crank\n"
    "    com: [crank/2, 0, 0]                     # centre of mass, in the axes of the body\n"
    "    inertia: {zz: rho*crank^3/12}            # about the centre of mass\n"
    "    points: {A: [0, 0, 0], B: [crank, 0, 0]}\n"
    "  coupler:\n"
    "    mass: rho*coupler\n"
    "    com: [coupler/2, 0, 0]\n"
    "    inertia: {zz: rho*coupler^3/12}\n"
    "    points: {B: [0, 0, 0], C: [coupler, 0, 0]}\n"
    "  rocker:\n"
    "    mass: rho*rocker\n"
    "    com: [rocker/2, 0, 0]\n"
    "    inertia: {zz: rho*rocker^3/12}\n"
    "    points: {D: [0, 0, 0], C: [rocker, 0, 0]}\n"
    "joints:                                      # four hinges in a loop: Kempe chooses the one to cut\n"
    "  A: {revolute: [ground.A, crank.A], axis: z}\n"
    "  B: {revolute: [crank.B, coupler.B], axis: z}\n"
    "  C: {revolute: [coupler.C, rocker.C], axis: z}\n"
    "  D: {revolute: [ground.D, rocker.D], axis: z}\n"
    "forces: {motor: {joint: A, torque: \"2 - 0.1*qd(A)\"}}          # N m\n"
    "start: {q: {A: 60 deg, B: -40 deg, D: 100 deg}, hold: [A]}    # guess of the angles; A keeps its value\n"
    "run: {t_end: 5 s, output_step: 20 ms, outputs: [q, qd, force(motor), position(coupler.C), energy]}\n";

static kempe_status print_new(const cli_job *j, const void *object, kempe_format format, char **text)
{
    const char *path = object;
    FILE *out = kmp_text_stream();
    (void)j;
    if (!out)
        return KEMPE_E_MEMORY;
    if (format == KEMPE_JSON) {
        cli_put_done(out, path);
    } else {
        const int stem = (int)(strlen(path) - strlen(".yaml"));
        fprintf(out,
                "%s: complete, a four-bar linkage with a motor\n\n"
                "next  kempe check %s\n      kempe simulate %s\n      kempe simulate %s --report %.*s.html\n",
                path, path, path, path, stem, path);
    }
    *text = kmp_text_stream_end(out);
    return *text ? KEMPE_OK : KEMPE_E_MEMORY;
}

/* The name is taken first, so that no file that is there can be lost; then the text replaces the empty file. */
static kempe_status write_new(const cli_job *j, const char *path)
{
    const int reserved = kmp_file_open(path, KMP_OPEN_WRITE | KMP_OPEN_NEW);
    if (reserved < 0) {
        if (errno == EEXIST)
            cli_complain("'%s' exists already and is kept: choose another name", path);
        else
            cli_complain("cannot write '%s': %s", path, strerror(errno));
        cli_refuse(j->settings->json);
        return KEMPE_E_FAILED;
    }
    (void)kmp_file_close(reserved);
    kempe_status status = kempe_write_file(j->context, path, template);
    if (status) {
        (void)kmp_path_remove(path);
        cli_report_failure(j, status, false);
    }
    return cli_worse(KEMPE_OK, status);
}

kempe_status cli_new(const cli_job *j)
{
    const char *file = j->settings->file;
    if (j->settings->elements && file) {
        cli_complain("--elements lists the library and writes no '%s': give one of them", file);
        cli_refuse(j->settings->json);
        return KEMPE_E_ARGUMENT;
    }
    if (j->settings->elements)
        return cli_list_elements(j);
    const size_t length = strlen(file);
    const char *ending = length >= 5 && strcmp(file + length - 5, ".yaml") == 0 ? "" : ".yaml";
    size_t size = length + strlen(ending) + 1;
    const char *name = kmp_path_name(file);
    if (!*name || strcmp(name, ".yaml") == 0 || strcmp(name, ".") == 0 || strcmp(name, "..") == 0) {
        cli_complain("'%s' names no file: 'kempe new four_bar' writes four_bar.yaml", file);
        cli_refuse(j->settings->json);
        return KEMPE_E_ARGUMENT;
    }
    char *path = malloc(size);
    if (!path) {
        cli_complain("out of memory");
        return KEMPE_E_MEMORY;
    }
    snprintf(path, size, "%s%s", file, ending);
    kempe_status status = write_new(j, path);
    if (status == KEMPE_OK)
        status = cli_worse(status, cli_report(j, print_new, path));
    free(path);
    return status;
}
