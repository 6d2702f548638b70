/* SPDX-License-Identifier: BSD-3-Clause */
#include "study.h"

#include <kempe/linearize.h>

TABLE(kempe_kinematics, "rows")
WRITER(kempe_kinematics_write_picture)
TABLE(kempe_inverse, "rows")
WRITER(kempe_linearization_write)
TABLE(kempe_modes, "rows")
WRITER(kempe_modes_write_picture)
TABLE(kempe_limit_cycles, "rows")
WRITER(kempe_limit_cycles_write_picture)
TABLE(kempe_response, "rows")
TABLE(kempe_comfort, "windows")
WRITER(kempe_response_write_picture)
TABLE(kempe_sensitivity, "rows")
REPORT_WRITER(kempe_modes_write_report)
REPORT_WRITER(kempe_limit_cycles_write_report)
REPORT_WRITER(kempe_equilibrium_write_report)
REPORT_WRITER(kempe_response_write_report)
REPORT_WRITER(kempe_inverse_write_report)
REPORT_WRITER(kempe_kinematics_write_report)
STUDY(kinematics, kempe_kinematics, kempe_kinematics_new(j->system, &s->kinematics, result),
      .table = kempe_kinematics_rows,
      .files = {{AT(svg), any_kempe_kinematics_write_picture}, REPORT(kempe_kinematics_write_report)})
STUDY(inverse, kempe_inverse, kempe_inverse_new(j->system, &s->inverse, result), .table = kempe_inverse_rows,
      .files = {REPORT(kempe_inverse_write_report)})
STUDY(modes, kempe_modes, kempe_modes_new(j->system, &s->modes, result), .table = kempe_modes_rows,
      .files = {{AT(svg), any_kempe_modes_write_picture}, REPORT(kempe_modes_write_report)})
STUDY(response, kempe_response, kempe_response_new(j->system, &s->response, result), .table = kempe_response_rows,
      .files = {{AT(svg), any_kempe_response_write_picture}, REPORT(kempe_response_write_report)})

/* Options of state spaces, which the response has, too. */
static kempe_status linearize_about(const cli_job *j, kempe_linearization **result)
{
    const kempe_response_options *s = &j->settings->response;
    const kempe_linearize_options options = {.at = s->at,
                                             .inputs = s->inputs,
                                             .outputs = s->outputs,
                                             .independent = s->independent,
                                             .backend = s->backend,
                                             .slide = s->slide};
    return kempe_linearization_new(j->system, &options, result);
}

STUDY(cycles, kempe_limit_cycles, kempe_limit_cycles_new(j->system, &s->cycles, result),
      .table = kempe_limit_cycles_rows,
      .files = {{AT(svg), any_kempe_limit_cycles_write_picture}, REPORT(kempe_limit_cycles_write_report)})
STUDY(equilibrium, kempe_equilibrium, kempe_equilibrium_new(j->system, &s->equilibrium, result), .table = NULL,
      .files = {REPORT(kempe_equilibrium_write_report)})
STUDY(linearize, kempe_linearization, linearize_about(j, result), .table = NULL,
      .files = {{AT(output), any_kempe_linearization_write}})
STUDY(comfort, kempe_comfort, kempe_comfort_new(j->system, &s->comfort, result), .table = kempe_comfort_rows)
STUDY(sensitivity, kempe_sensitivity, kempe_sensitivity_new(j->model, &s->sensitivity, result),
      .table = kempe_sensitivity_rows)
