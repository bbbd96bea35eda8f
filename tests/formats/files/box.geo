// A unit cube of tetrahedra with its surface.
SetFactory("Built-in");
Point(1) = {0,0,0,0.4}; 
a[] = Extrude {1,0,0} { Point{1}; };
b[] = Extrude {0,1,0} { Line{a[1]}; };
c[] = Extrude {0,0,1} { Surface{b[1]}; };
Mesh.MeshSizeMax = 0.4;
