% The detective robot, completed from the first lines of the paper's listing.
% Builds the same flat model as detective.py; README.md explains the parameters.

[top]
components : RadarSystem MovingSystem
out : Out1 Out2 Out3
in : In1 In2 In3 In4 In5
Link : In1 MS_In1@MovingSystem
Link : In2 RS_In2@RadarSystem
Link : In3 RS_In3@RadarSystem
Link : In4 MS_In3@MovingSystem
Link : In5 MS_In4@MovingSystem
Link : MS_Out1@MovingSystem RS_In1@RadarSystem
Link : RS_Out2@RadarSystem MS_In2@MovingSystem
Link : RS_Out1@RadarSystem Out1
Link : MS_Out2@MovingSystem Out2
Link : MS_Out3@MovingSystem Out3

[RadarSystem]
components : sonar1@Sonar1 compass1@Compass1 radarController@RadarController motor1@Motor
out : RS_Out1 RS_Out2
in : RS_In1 RS_In2 RS_In3
Link : RS_In1 radar_in1@radarController
Link : RS_In2 echo@sonar1
Link : RS_In3 reading@compass1
Link : object@sonar1 radar_in2@radarController
Link : degree@compass1 radar_in3@radarController
Link : radar_out1@radarController order@motor1
Link : radar_out2@radarController RS_Out2
Link : radar_out3@radarController request@compass1
Link : spin@motor1 RS_Out1

[sonar1]
sonarTime : 00:00:00:010

[compass1]
compassTime : 00:00:00:010

[radarController]
radarTime : 00:00:00:010
turnTime : 00:00:03:000

[motor1]
motorTime : 00:00:00:010

[MovingSystem]
components : compass2@Compass2 sonar2@Sonar2 movementController@MovementController
components : motor2@Motor motor3@Motor
out : MS_Out1 MS_Out2 MS_Out3
in : MS_In1 MS_In2 MS_In3 MS_In4
Link : MS_In1 move_in1@movementController
Link : MS_In2 move_in2@movementController
Link : MS_In3 reading@compass2
Link : MS_In4 echo@sonar2
Link : answer@compass2 move_in3@movementController
Link : target@sonar2 move_in4@movementController
Link : move_out1@movementController MS_Out1
Link : move_out2@movementController order@motor2
Link : move_out3@movementController order@motor3
Link : move_out4@movementController request@compass2
Link : move_out5@movementController request@sonar2
Link : spin@motor2 MS_Out2
Link : spin@motor3 MS_Out3

[compass2]
compassTime : 00:00:00:010
tolerance : 0

[sonar2]
sonarTime : 00:00:00:010

[movementController]
movementTime : 00:00:00:010

[motor2]
motorTime : 00:00:00:010

[motor3]
motorTime : 00:00:00:010
