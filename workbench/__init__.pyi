"""The names of the root and where they live: read by type checkers and editors, and by `__getattr__`."""

from workbench.arm.built_in_arms import load_robot as load_robot
from workbench.arm.frame import Frame as Frame
from workbench.arm.inverse.solve import follow as follow
from workbench.arm.inverse.solve import solve as solve
from workbench.arm.kinematics.forward import link_frames as link_frames
from workbench.arm.kinematics.forward import sensitivity as sensitivity
from workbench.arm.kinematics.forward import sensitivity_blocks as sensitivity_blocks
from workbench.arm.kinematics.forward import tool_poses as tool_poses
from workbench.arm.motion import Motion as Motion
from workbench.arm.mounting import Mounting as Mounting
from workbench.arm.robot import Robot as Robot
from workbench.arm.robot_toml import write_toml as write_toml
from workbench.arm.urdf import read_urdf as read_urdf
from workbench.arm.urdf import write_urdf as write_urdf
from workbench.base.errors import WorkbenchError as WorkbenchError
from workbench.base.progress import running as running
from workbench.data.accuracy_requirement import Requirement as Requirement
from workbench.data.accuracy_requirement import Wanted as Wanted
from workbench.data.dataset import Dataset as Dataset
from workbench.data.order import split_sessions as split_sessions
from workbench.data.readers import Trajectory as Trajectory
from workbench.data.readers import read_measurements as read_measurements
from workbench.data.readers import read_trajectory as read_trajectory
from workbench.data.simulation.instruments import Instrument as Instrument
from workbench.data.writer import write_measurements as write_measurements
from workbench.diagnosis.diagnose import diagnose as diagnose
from workbench.diagnosis.identify_with_effects import identify as identify
from workbench.diagnosis.result import Diagnosis as Diagnosis
from workbench.extras.camera.pixel_table import read_pixels as read_pixels
from workbench.extras.camera.rig import read_rig as read_rig
from workbench.extras.hobby.follow import Following as Following
from workbench.extras.hobby.follow import compare_leader as compare_leader
from workbench.extras.hobby.motor_map import MotorMap as MotorMap
from workbench.extras.hobby.motor_map import map_motors as map_motors
from workbench.extras.pendant.extract import Extraction as Extraction
from workbench.extras.pendant.extract import extract as extract
from workbench.extras.pendant.own_robot.find_convention import find_convention as find_convention
from workbench.extras.pendant.own_robot.readings import table_readings as table_readings
from workbench.extras.pendant.own_robot.readings import typed_readings as typed_readings
from workbench.extras.pendant.touching.check import Check as Check
from workbench.extras.pendant.touching.check import check as check
from workbench.extras.pendant.touching.tool_tip import ToolTip as ToolTip
from workbench.extras.pendant.touching.tool_tip import tcp as tcp
from workbench.extras.pendant.touching.user_frame import UserFrame as UserFrame
from workbench.extras.pendant.touching.user_frame import frame as frame
from workbench.extras.production.trial import try_plate as try_plate
from workbench.extras.service.fleet.fleet import Fleet as Fleet
from workbench.extras.service.fleet.fleet import compare_fleet as compare_fleet
from workbench.extras.service.rezero.moved_joints import rezero as rezero
from workbench.extras.service.verification.verify import Verification as Verification
from workbench.extras.service.verification.verify import verify as verify
from workbench.identification.evaluate import evaluate as evaluate
from workbench.identification.fit_choices import FitChoices as FitChoices
from workbench.identification.prior import Prior as Prior
from workbench.identification.problem import Noise as Noise
from workbench.identification.result import Evaluation as Evaluation
from workbench.identification.result import Identification as Identification
from workbench.paths.trajectories import compensate_trajectory
from workbench.plate.design import optimise_plate as optimise_plate
from workbench.plate.measured_plate import load_plate as load_plate
from workbench.plate.optimiser.optimise import DesignRequest as DesignRequest
from workbench.plate.optimiser.result import PlateDesign as PlateDesign
from workbench.plate.plate import Plate as Plate
from workbench.plate.plate import Target as Target
from workbench.plate.plate_toml import write_plate as write_plate
from workbench.plate.poses.choose_poses import choose_poses as choose_poses
from workbench.plate.poses.pose_limits import PoseLimits as PoseLimits
from workbench.plate.region import Region as Region
from workbench.plate.score import PlateScore as PlateScore
from workbench.plate.score import score_plate
from workbench.plate.simulated_measurement import measure_plate as measure_plate
from workbench.plate.simulated_measurement import measure_poses as measure_poses
from workbench.views.page.show import show as show

compensate = compensate_trajectory
score = score_plate
