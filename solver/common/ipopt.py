"""Step sizes and IPOPT options of the reference solvers.

Cable displacements are given over the cable offset a, positions over the robot's longest length L.
"""

from typing import Any

import casadi as ca

LARGEST_STEP, SMALLEST_STEP = 0.03125, 0.00375  # of one solve, and of the last attempt [a]
INSERTION = 11.25  # displacement that counts as much as an insertion by L [a]
LOADING = 0.625  # displacement that counts as much as all of the loads [a]
PRETENSION = 0.00625  # a touching robot is not slackened below it [a]
SLACK = 1.25e-4  # below it a shear costs too little for IPOPT, and the robot is taken as free [a]
ANGLE_UNIT = 0.02  # of the disk angles of a rod [rad]
UNIT = 0.125  # of lengths of a rod, for which the tolerances below are [a]
RESOLUTION = 1.25e-7  # to which the command at the tension limit is found [a]
MOVE_OFFSET, MOVE_SLOPE = 0.0028, 0.71  # a node that moves farther than offset + slope·|step| has left the branch [L]

Options = dict[str, Any]  # as CasADi nests them

OPTIONS: Options = {
    "print_time": False,
    "ipopt": {
        "print_level": 0,
        "sb": "yes",
        "max_iter": 500,
        "tol": 1e-11,
        "dual_inf_tol": 1e-10,
        "constr_viol_tol": 1e-11,
        "compl_inf_tol": 1e-11,
        "acceptable_iter": 0,
        "bound_relax_factor": 0.0,
        "nlp_scaling_method": "none",
        "mu_init": 1e-9,
        "warm_start_init_point": "yes",
        "warm_start_bound_push": 1e-9,
        "warm_start_bound_frac": 1e-9,
        "warm_start_slack_bound_push": 1e-9,
        "warm_start_slack_bound_frac": 1e-9,
        "warm_start_mult_bound_push": 1e-9,
    },
}


def nlp_solver(problem: dict[str, ca.MX], options: Options, plugin: str = "ipopt") -> ca.Function:
    """Return CasADi's solver of a nonlinear problem with unknowns x, parameters p, objective f and constraints g."""
    symbols: dict[str, Any] = dict(problem)  # CasADi's own type for its values is private
    return ca.nlpsol("reference", plugin, symbols, options)
