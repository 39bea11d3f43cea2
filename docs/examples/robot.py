from algorithms.kinematics import Robot

arm = Robot.named("ur5")                             # or Robot.from_urdf("arm.urdf")
q = [0.1, -1.2, 1.5, -0.3, 0.8, 0.2]
pose, J = arm.pose(q), arm.jacobian(q)               # (4, 4) and (6, 6)
torques = arm.inverse_dynamics(q, [0.0] * 6, [0.0] * 6)
print(arm.inverse(pose).q.round(3), torques.round(2))     # eight configurations reach the pose
