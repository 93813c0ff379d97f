"""Two driven eccentric masses on a rotor: plant, estimators, regulator, supervisor and the run of them all.

Importing this package loads the compiler, so that only what runs driven masses should do it.
"""

from ringbalance.controller.eccentric.document import eccentric_document
from ringbalance.controller.eccentric.figures_bound import MotionBound, motion_bound
from ringbalance.controller.eccentric.figures_effort import FigureSix, figure_six
from ringbalance.controller.eccentric.figures_extremes import (
    EulerMap,
    WrongBelief,
    euler_map,
    friction_extremes,
    noise_extremes,
    saturation_curve,
    wrong_belief,
)
from ringbalance.controller.eccentric.figures_imbalance import (
    FigureFour,
    estimate_imbalance,
    figure_four,
    imbalance_record,
)
from ringbalance.controller.eccentric.figures_runs import (
    BalancingFigure,
    FigureFive,
    FigureNine,
    figure_eight,
    figure_five,
    figure_nine,
    figure_seven,
    run_up_peak,
    steady_peak_speed,
)
from ringbalance.controller.eccentric.figures_scenes import at_constant_speed, changed
from ringbalance.controller.eccentric.friction_filter import (
    FrictionEstimate,
    FrictionNoise,
    TrackModel,
    friction_flow,
    friction_step,
)
from ringbalance.controller.eccentric.imbalance_filter import (
    ImbalanceEstimate,
    correct,
    imbalance_deviation,
    imbalance_history,
    predict,
    predicted_deviation,
    start_estimate,
)
from ringbalance.controller.eccentric.imbalance_filter_model import (
    FilterMatrices,
    ProcessNoise,
    WhirlModel,
    dynamic_stiffness,
    euler_step_limit,
    filter_matrices,
    whirl_generator,
    whirl_transition,
)
from ringbalance.controller.eccentric.imbalance_filter_scene import expected_deviation
from ringbalance.controller.eccentric.lqr import LqrGain, lqr_gain, lqr_gain_discrete
from ringbalance.controller.eccentric.parameters import PlantParameters, plant_parameters
from ringbalance.controller.eccentric.plant_run import PlantRun, run_plant
from ringbalance.controller.eccentric.plant_whirl import influence, steady_whirl
from ringbalance.controller.eccentric.run import simulate_eccentric
from ringbalance.controller.eccentric.run_record import EccentricOutcome, EccentricRun, StageSpan
from ringbalance.controller.eccentric.show import show_eccentric
from ringbalance.controller.eccentric.strategy import strategy_start, strategy_step
from ringbalance.controller.eccentric.strategy_records import (
    EccentricMeasurement,
    StrategySettings,
    StrategyState,
)
from ringbalance.controller.eccentric.strategy_settings import (
    believed_whirl,
    strategy_settings,
    track_model,
)
from ringbalance.controller.eccentric.targets import Assignment, Targets, assign, target_angles

__all__ = [
    "Assignment",
    "BalancingFigure",
    "EccentricMeasurement",
    "EccentricOutcome",
    "EccentricRun",
    "EulerMap",
    "FigureFive",
    "FigureFour",
    "FigureNine",
    "FigureSix",
    "FilterMatrices",
    "FrictionEstimate",
    "FrictionNoise",
    "ImbalanceEstimate",
    "LqrGain",
    "MotionBound",
    "PlantParameters",
    "PlantRun",
    "ProcessNoise",
    "StageSpan",
    "StrategySettings",
    "StrategyState",
    "Targets",
    "TrackModel",
    "WhirlModel",
    "WrongBelief",
    "assign",
    "at_constant_speed",
    "believed_whirl",
    "changed",
    "correct",
    "dynamic_stiffness",
    "eccentric_document",
    "estimate_imbalance",
    "euler_map",
    "euler_step_limit",
    "expected_deviation",
    "figure_eight",
    "figure_five",
    "figure_four",
    "figure_nine",
    "figure_seven",
    "figure_six",
    "filter_matrices",
    "friction_extremes",
    "friction_flow",
    "friction_step",
    "imbalance_deviation",
    "imbalance_history",
    "imbalance_record",
    "influence",
    "lqr_gain",
    "lqr_gain_discrete",
    "motion_bound",
    "noise_extremes",
    "plant_parameters",
    "predict",
    "predicted_deviation",
    "run_plant",
    "run_up_peak",
    "saturation_curve",
    "show_eccentric",
    "simulate_eccentric",
    "start_estimate",
    "steady_peak_speed",
    "steady_whirl",
    "strategy_settings",
    "strategy_start",
    "strategy_step",
    "target_angles",
    "track_model",
    "whirl_generator",
    "whirl_transition",
    "wrong_belief",
]
