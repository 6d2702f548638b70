# SPDX-License-Identifier: BSD-3-Clause
"""Public functions of the library that the Python package does without, each with the reason."""

LEFT_OUT = {
    "kempe_status_text": "classes of errors have names",
    "kempe_context_set_log": "by python_listen, which leaves out what nobody reads",
    "kempe_context_set_angle_unit": "arrays are in SI",
    "kempe_context_set_units": "arrays are in SI",
    "kempe_cache_folder": "the caller names a folder",
    "kempe_ensemble_result_quantity_unit": "units are those of the columns of tables",
    "kempe_ensemble_new": "kempe_ensemble_new_with without options",
    "kempe_model_read": "kempe_model_read_set without settings",
    "kempe_model_read_text": "kempe_model_read_text_set without settings",
    "kempe_number_read": "numbers are Python's",
    "kempe_value": "numbers of builders are made by reflection",
    "kempe_expression": "numbers of builders are made by reflection",
    "kempe_table_number": "columns are arrays",
    "kempe_table_name_units": "units are attributes of tables",
    "kempe_model_input_find": "names of inputs are a dict",
    "kempe_outputs_find": "names of outputs are a tuple",
    "kempe_report_check": "writing a report checks the same",
    "kempe_trajectory_time": "the column t of the rows",
    "kempe_workspace_evaluate_states": "by python_evaluate_states, which reads states as the other functions of rows do",
    "kempe_workspace_forward_states": "by python_forward_states",
    "kempe_workspace_name_count": "by kempe._calls, for the lengths of arrays",
    "kempe_workspace_derivative_states": "by python_derivative_states",
    "kempe_write_file": "Python writes files",
    "kempe_context_is_source": "writers refuse such files themselves",
}
